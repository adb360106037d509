// What the arm follows: its goal, a path, a sub-goal, or a trajectory out of the way; and where barriers leave room.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double near_moving = 0.1;                  // [m] of the arm: near what moves barriers leave no room
constexpr double moving_foresight = 1.0;             // [s] in which it could be as near
constexpr std::uint64_t most_posture_attempts = 12;  // one after the other
constexpr double posture_pause = 2.0;                // [s] until as many more
constexpr int periods_late = 1000;                   // a trajectory is moved on by at most so many at once

}  // namespace

void Controller::Impl::begin_goal() noexcept {
  begins_goal_ = false;
  if (auto* joint = std::get_if<JointGoal>(goal_)) {
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      if (is_unlimited_[static_cast<std::size_t>(j)]) {  // the nearest turn
        joint->position[j] += 2.0 * std::numbers::pi * std::round((q_[j] - joint->position[j]) / (2.0 * std::numbers::pi));
      }
    }
    if (moves_) {
      return;
    }
    if (target_ != joint->position) {  // the same goal set again is no other
      forget_way();
    }
    target_ = joint->position;
    has_target_ = posture_found_ = true;
    if (guide) {
      guide->set_goal(target_);
    }
  } else if (!moves_) {
    forget_way();
    next_posture(std::get<PoseGoal>(*goal_));
  }
}

void Controller::Impl::next_posture(const PoseGoal& pose) noexcept {
  guide_status_ = OnlinePlannerStatus::idle;
  has_target_ = target_blocked_ = rests_ = false;
  if (settings.synchronous) {
    guarded([&] { take_posture(search_posture(pose, q_, obstacles(), posture_attempt_, goal_number_)); });
  } else {
    wakes_worker_ = true;
  }
}

void Controller::Impl::take_posture(const Posture& posture) noexcept {
  target_ = posture.q;
  has_target_ = true;
  posture_found_ = posture.found();
  if (guide) {
    guide->set_goal(target_);
  }
}

void Controller::Impl::choose_reference() noexcept {
  JointGoal& reference = std::get<JointGoal>(reference_);
  followed_ = &reference_;
  const auto rest_at = [&](const Eigen::VectorXd& q) {
    reference.position = q;
    reference.velocity.setZero();
    reference.acceleration.setZero();
  };
  if (!measurement_.agrees) {  // what was told begins once the arm is known to be there
    pulls_ = waits_ = false;
    rest_at(q_);
    return;
  }
  if (begins_input_) {
    begin_input();
  }
  pulls_ = waits_ = false;
  if (has_input() && !is_stale()) {
    follow_input();
  }
  if (begins_goal_) {
    begin_goal();
  }
  if (!has_goal() || is_stale()) {
    rest_at(q_);
    return;
  }
  if (moves_) {
    followed_ = goal_;
    return;
  }
  const PoseGoal* pose = pose_goal();
  if (pose != nullptr) {
    if (!settings.synchronous && postures_.update()) {
      const FoundPosture& found = postures_.current();
      taken_.posture = &found;
      if (found.goal_number == goal_number_ && found.attempt == posture_attempt_) {
        take_posture(found.posture);
      }
    }
    // A posture that no way leads to: another one.
    const bool fails = guide_status_ == OnlinePlannerStatus::no_path ||
                       guide_status_ == OnlinePlannerStatus::goal_in_collision || (stops_short() && (!guide || rests_));
    if (has_target_ && fails && time_ >= next_posture_) {
      if (++posture_attempt_ % most_posture_attempts == 0) {
        next_posture_ = time_ + posture_pause;
      }
      next_posture(*pose);
    }
    if (!has_target_) {
      rest_at(q_);
      return;
    }
  }
  if (guide) {
    guide_status_ = guide->step(q_, time_, path_reference_);
    taken_.answer = guide->taken();
    taken_.look = guide->taken_look();
    reference.position = path_reference_.position;
    reference.velocity = path_reference_.velocity;
    reference.acceleration = path_reference_.acceleration;
    if (guide->following().route_number != 0) {
      hold_to_path(q_, v_, reference);
    }
  } else {
    rest_at(target_);
  }
  const bool led = guide && guide_status_ != OnlinePlannerStatus::no_path;
  if (escape_ && !led && !target_blocked_ && !avoiding_) {
    followed_ = &escape_->pursue(reference_, arm_q_, std::numeric_limits<double>::quiet_NaN(), settings.period);
  }
}

void Controller::Impl::hold_to_path(const Eigen::VectorXd& q, const Eigen::VectorXd& v, JointGoal& reference) const noexcept {
  const double w = settings.inputs.frequency, K = settings.barriers.stiffness, D = settings.barriers.damping;
  reference.acceleration +=
      std::max(0.0, w * w - K) * (reference.position - q) + std::max(0.0, 2.0 * w - D) * (reference.velocity - v);
}

void Controller::Impl::write_places(Eigen::MatrixXd& places, Eigen::Index& num) const noexcept {
  num = 0;
  if (!has_target_) {
    return;
  }
  if (guide) {
    places.leftCols(path_reference_.num_places) = path_reference_.places.leftCols(path_reference_.num_places);
    num = path_reference_.num_places;
    if (!path_reference_.arrives) {
      return;
    }
  }
  places.col(num++) = target_;
}

void Controller::Impl::leave_room(bool looks) noexcept {
  if (looks) {
    disturbed_ = body_.nearest_moving(q_, obstacles(), moving_foresight, here_) < near_moving ||
                 closing_.nearest(moving_foresight) < near_moving;
    if (obstacles().tree().moves()) {
      failsafe_.look_anew();
    }
  }
  if (!settings.local_activation) {
    return;
  }
  if (disturbed_ || !has_target_) {
    if (looks) {
      workspace.activations = system->activations();
      num_lowered_ = -1;
    }
    return;
  }
  if (settings.synchronous) {
    if (looks) {
      keep_room();
    }
  } else {
    const Activations* const fresh = taken_.activations = activations_.update() ? &activations_.current() : nullptr;
    if (fresh != nullptr || looks) {
      const Activations& found = activations_.current();
      const bool ours = found.goal_number == goal_number_ && found.posture_attempt == posture_attempt_;
      workspace.activations = ours ? found.values : system->activations();
      target_blocked_ = ours && found.target_blocked;
    }
  }
}

void Controller::Impl::keep_room() noexcept {
  write_places(places_, num_places_);
  const std::uint64_t version = obstacles().version();
  if (num_places_ == num_lowered_ && version == lowered_version_ &&
      places_.leftCols(num_places_) == lowered_places_.leftCols(num_places_)) {
    return;
  }
  target_blocked_ = lower_at(places_, num_places_, obstacles(), room_, workspace.activations);
  lowered_places_ = places_;
  num_lowered_ = num_places_;
  lowered_version_ = version;
}

bool Controller::Impl::lower_at(const Eigen::MatrixXd& places, Eigen::Index num, const Obstacles& around,
                                GeometricSystem::Workspace& w, Eigen::VectorXd& activations) const noexcept {
  activations = system->activations();
  bool inside = false;
  for (Eigen::Index k = 0; k < num; ++k) {
    static_cast<void>(system->lower_activations(places.col(k), around, w, activations));
    inside = false;
    for (const Eigen::Index i : metric_coordinates_) {
      inside = inside || w.clearances.least[i] < 0.0;
    }
  }
  return inside;
}

void Controller::Impl::avoid() noexcept {
  if (!evasion_) {
    return;
  }
  if (settings.synchronous) {
    guarded([&] {
      LookAhead::Leader leader;
      if (evasion_->is_due(settings.period) && pulls_ && trajectory_order()) {
        leader = leader_of(trajectory_order()->path, clock_.time, clock_.rate);
      } else if (evasion_->is_due(settings.period) && guide && has_target_ && followed_ == &reference_) {
        leader = leader_of(guide->following());
      }
      const AvoidanceTrajectory* found = evasion_->pursue(*followed_, q_, v_, obstacles(), settings.period, leader);
      avoiding_ = found != nullptr;
      if (avoiding_) {
        trajectory_ = *found;
      }
    });
  } else {
    if (avoiding_) {
      trajectory_.advance(settings.period);
    }
    taken_.trajectory = trajectories_.update() ? &trajectories_.current() : nullptr;
    pending_ = taken_.trajectory != nullptr || pending_;
    const FoundTrajectory& found = trajectories_.current();
    if (taken_.trajectory != nullptr) {
      pending_excess_ = std::max(0.0, found.duration - (time_ - found.time));
    }
    const double late = time_ - (found.time + settings.look_ahead->delay);
    if (pending_ && late > -0.5 * settings.period) {
      pending_ = false;
      looked_at_ = found.time;
      look_excess_ = pending_excess_;
      avoiding_ = found.avoid;
      if (avoiding_) {
        trajectory_ = found.trajectory;
        const int periods = std::min(periods_late, static_cast<int>(std::lround(late / settings.period)));
        for (int k = 0; k < periods; ++k) {
          trajectory_.advance(settings.period);
        }
      }
    }
  }
  if (avoiding_) {
    std::get<JointGoal>(avoidance_goal_).position = trajectory_.target();
  }
}

void Controller::Impl::judge_age() noexcept {
  if (settings.synchronous) {
    return;
  }
  command.planner_age = guide && has_target_ ? guide->age(time_) : 0.0;
  command.look_ahead_age = evasion_ ? time_ - looked_at_ + look_excess_ : 0.0;
  // Where nothing moves near the arm, a look-ahead has nothing to say; and the way out of the way is not slowed.
  pace_ = evasion_ && disturbed_ && !avoiding_ ? settings.look_ahead->pace(command.look_ahead_age) : 1.0;
  command.pace = pace_;
  if (guide && evasion_ && !settings.speed_limits) {
    guide->limit_pace(pace_);
  }
}

}  // namespace sidestep
