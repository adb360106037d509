#include "goal_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "../math/settings.hpp"
#include "path_hold.hpp"

namespace sidestep {
namespace {

constexpr std::uint64_t most_posture_attempts = 12;  // postures that are tried one after the other
constexpr double posture_pause = 2.0;                // time until as many more [s]
// Time of rest from which an arm that is inside something counts as unable to get out: the reactive layer takes less [s].
constexpr double held_inside = 1.0;
// Speed of a frame on the path, as a share of the limit, so that rows which slow the arm do not let the reference run ahead [-].
constexpr double of_limit = 0.95;

std::unique_ptr<OnlinePlanner> make_planner(const ClearanceQuery& body, const ControllerSettings& settings,
                                            const std::optional<RigidBodyDynamics>& dynamics, bool works) {
  if (!settings.planner) {
    return nullptr;
  }
  OnlinePlannerConfig config;
  config.planner = *settings.planner;
  config.planner.route.speed = settings.speed;
  config.safety = settings.safety;
  config.seed = settings.seed;
  if (dynamics) {
    config.dynamics.emplace(*dynamics);
  }
  config.synchronous = settings.synchronous;
  config.works = works;
  return std::make_unique<OnlinePlanner>(body, config);
}

}  // namespace

GoalMemory::GoalMemory(Eigen::Index nv) : target(Eigen::VectorXd::Zero(nv)), led(JointGoal(target)) {}

GoalFollower::GoalFollower(const ClearanceQuery& body, const ControllerSettings& settings, const JointKinds& joints,
                           const std::optional<RigidBodyDynamics>& dynamics, RequestBoard& board, bool works)
    : GoalMemory(body.robot().num_coordinates()),
      body_(body),
      settings_(settings),
      joints_(joints),
      board_(board),
      postures_(body, settings),
      found_(FoundPosture{0, 0, {target, 0.0, 0.0}}),
      planner_(make_planner(body, settings, dynamics, works)),
      path_(target.size()),
      on_path_(body.robot()) {
  if (settings.local_minimum) {
    LocalMinimumSettings recovery = *settings.local_minimum;
    recovery.seed = settings.seed;
    local_minimum_.emplace(body.robot(), recovery);
  }
}

void GoalFollower::leave(bool goal) noexcept {
  has_target = posture_found = false;
  posture_attempt = 0;
  planner_status_ = OnlinePlannerStatus::idle;
  next_posture = 0.0;
  begins = goal;
}

void GoalFollower::begin_anew(bool has_goal) noexcept {
  begins = has_goal;
  next_posture = 0.0;
}

bool GoalFollower::begin(Goal& goal, bool moves, const Moment& now) noexcept {
  begins = false;
  if (auto* joint = std::get_if<JointGoal>(&goal)) {
    for (Eigen::Index j = 0; j < target.size(); ++j) {
      if (joints_.is_unlimited(j)) {  // the nearest turn
        joint->position[j] +=
            2.0 * std::numbers::pi * std::round((now.reference.q[j] - joint->position[j]) / (2.0 * std::numbers::pi));
      }
    }
    if (moves) {
      return false;
    }
    const bool is_another = target != joint->position;  // the same goal set again is no other
    target = joint->position;
    has_target = posture_found = true;
    if (planner_) {
      planner_->set_goal(target);
    }
    return is_another;
  }
  if (moves) {
    return false;
  }
  next(std::get<PoseGoal>(goal), now);
  return true;
}

void GoalFollower::next(const PoseGoal& pose, const Moment& now) noexcept {
  planner_status_ = OnlinePlannerStatus::idle;
  has_target = false;
  if (!settings_.synchronous) {
    asks_worker = true;
    return;
  }
  board_.guarded([&] {
    const Posture found = postures_.find(pose, now.reference.q, now.obstacles, posture_attempt);
    board_.show_posture(now.request_number, found);
    take(found);
  });
}

void GoalFollower::take(const Posture& posture) noexcept {
  target = posture.q;
  has_target = true;
  posture_found = posture.found();
  if (planner_) {
    planner_->set_goal(target);
  }
}

const Goal& GoalFollower::rest_at(const Eigen::VectorXd& q) noexcept {
  JointGoal& goal = std::get<JointGoal>(led);
  goal.position = q;
  goal.velocity.setZero();
  goal.acceleration.setZero();
  return led;
}

void GoalFollower::update_posture(const PoseGoal& pose, const Moment& now, TargetFindings& findings) noexcept {
  if (!settings_.synchronous && found_.update()) {
    const FoundPosture& found = found_.current();
    taken_.posture = &found;
    if (found.request_number == now.request_number && found.attempt == posture_attempt) {
      take(found.posture);
    }
  }
  // A posture that no way leads to: another one.
  const bool fails = planner_status_ == OnlinePlannerStatus::no_path ||
                     planner_status_ == OnlinePlannerStatus::goal_in_collision ||
                     (stops_short(&led, findings.blocked) && (!planner_ || findings.rests));
  if (has_target && fails && now.tick.time >= next_posture) {
    if (++posture_attempt % most_posture_attempts == 0) {
      next_posture = now.tick.time + posture_pause;
    }
    findings = {};
    next(pose, now);
  }
}

const Goal& GoalFollower::lead(const PoseGoal* pose, const Moment& now, bool avoids, TargetFindings& findings) noexcept {
  if (pose != nullptr) {
    update_posture(*pose, now, findings);
    if (!has_target) {
      return rest_at(now.reference.q);
    }
  }
  if (!planner_) {
    rest_at(target);
  } else {
    planner_status_ = planner_->step(now.reference.q, now.tick.time, path_, now.tick.gap ? now.tick.held : infinity);
    taken_.answer = planner_->taken();
    taken_.look = planner_->taken_look();
    JointGoal& goal = std::get<JointGoal>(led);
    goal.position = path_.position;
    goal.velocity = path_.velocity;
    goal.acceleration = path_.acceleration;
    if (planner_->following().route_number != 0) {
      hold_to_path(settings_, now.reference.q, now.reference.v, goal);
    }
  }
  const bool is_led = planner_ && planner_status_ != OnlinePlannerStatus::no_path;
  if (local_minimum_ && !is_led && !findings.blocked && !avoids) {
    return local_minimum_->pursue(led, now.arm_q, std::numeric_limits<double>::quiet_NaN(), now.tick.moved);
  }
  return led;
}

void GoalFollower::limit_speed(double speed_limit, double pace, const FrameSpeeds& frames) noexcept {
  if (!planner_) {
    return;
  }
  on_path_.update(body_.robot(), path_.position, path_.velocity);
  const double speed = frames.fastest(on_path_).speed, now = planner_->following().follower.pace;
  planner_->limit_pace(
      std::min(pace, now > 0.0 && speed > of_limit * speed_limit * now ? of_limit * speed_limit * now / speed : 1.0));
}

bool GoalFollower::stops_short(const Goal* followed, bool blocked) const noexcept {
  return blocked && (!planner_ || (path_.arrives && followed == &led));
}

Way GoalFollower::way(double rest_time, const Goal* followed, bool blocked) const noexcept {
  if (!has_target) {
    return Way::unknown;  // another posture is looked for
  }
  if (!posture_found || planner_status_ == OnlinePlannerStatus::no_path ||
      planner_status_ == OnlinePlannerStatus::goal_in_collision || stops_short(followed, blocked)) {
    return Way::none;
  }
  if (!planner_) {
    return Way::open;
  }
  if (planner_status_ == OnlinePlannerStatus::start_in_collision) {
    return rest_time < held_inside ? Way::unknown : Way::none;
  }
  return planner_->following().route_number == 0 ? Way::unknown : Way::open;
}

void GoalFollower::write_places(Places& places) const noexcept {
  places.num = 0;
  if (!has_target) {
    return;
  }
  if (planner_) {
    places.q.leftCols(path_.num_places) = path_.places.leftCols(path_.num_places);
    places.num = path_.num_places;
    if (!path_.arrives) {
      return;
    }
  }
  places.q.col(places.num++) = target;
}

OnlinePlanner::Following GoalFollower::following(const Goal* followed) const noexcept {
  return planner_ && has_target && followed == &led ? planner_->following() : OnlinePlanner::Following{};
}

void GoalFollower::go_on_from(const GoalFollower& before, bool has_goal_at_rest) noexcept {
  static_cast<GoalMemory&>(*this) = before;
  next_posture = 0.0;
  if (planner_ && has_target) {
    planner_->set_goal(target);
  }
  asks_worker = true;
  begins = begins || (has_goal_at_rest && !has_target);
}

}  // namespace sidestep
