// The part of the controller beside the loop: postures, room at places, trajectories out of the way.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr int posture_starts = 40;        // from which a posture for a pose is searched at first
constexpr int posture_starts_again = 20;  // and for another one

}  // namespace

void Controller::Impl::run() {
  while (!stopping_.load()) {
    static_cast<void>(wake_.try_acquire_for(std::chrono::duration<double>(look_period_)));
    if (snapshots_.update() && !stopping_.load()) {
      guarded([this] { look(snapshots_.current()); });
    }
  }
}

void Controller::Impl::note_fault(const char* what) noexcept {
  try {
    const std::lock_guard lock(mutex_);
    std::snprintf(shown_fault_.data(), shown_fault_.size(), "%s", what);
  } catch (...) {  // a mutex that fails: nothing is noted
  }
}

Obstacles Controller::Impl::obstacles_at(const Snapshot& snapshot) const {
  std::shared_ptr<const Obstacles> newest;
  bool same;
  {
    const std::lock_guard lock(mutex_);
    newest = shown_obstacles_;
    same = obstacle_count_ == snapshot.obstacle_number;
  }
  Obstacles now = *newest;
  if (same) {
    now.advance(snapshot.obstacle_age);
  }
  return now;
}

void Controller::Impl::look(const Snapshot& s) {
  Order order;
  {
    const std::lock_guard lock(mutex_);
    if (goal_count_ == s.goal_number) {
      order = shown_order_;
    }
  }
  const Goal* goal = std::get_if<Goal>(&order);
  const Obstacles around = obstacles_at(s);
  if (guide && around.tree().moves()) {
    const std::lock_guard lock(mutex_);
    if (obstacle_count_ == s.obstacle_number) {  // else newer ones have been set: the planner knows them already
      guide->set_obstacles(around);
    }
  }
  const auto* pose = goal ? std::get_if<PoseGoal>(goal) : nullptr;
  if (pose != nullptr && !is_moving(*pose) && (sought_goal_ != s.goal_number || sought_attempt_ != s.posture_attempt)) {
    FoundPosture& found = postures_.draft();
    found = {s.goal_number, s.posture_attempt, search_posture(*pose, s.q, around, s.posture_attempt, s.goal_number)};
    postures_.submit();
    sought_goal_ = s.goal_number;
    sought_attempt_ = s.posture_attempt;
  }
  if (settings.local_activation && s.num_places > 0) {
    Activations& room = activations_.draft();
    room.goal_number = s.goal_number;
    room.posture_attempt = s.posture_attempt;
    room.target_blocked = lower_at(s.places, s.num_places, around, worker_workspace_, room.values);
    activations_.submit();
  }
  if (evasion_ && s.time >= next_trajectory_) {
    next_trajectory_ = s.time + settings.look_ahead->delay - 0.5 * look_period_;
    Goal followed = s.followed;
    if (s.by_pose && pose != nullptr) {
      followed = *pose;
      advance(followed, s.order_age);
    }
    LookAhead::Leader leader = leader_of(s.following);
    if (auto* trajectory = std::get_if<TrajectoryOrder>(&order); trajectory != nullptr && s.on_trajectory) {
      trajectory->path.begin_at(s.begin_q, s.begin_v);
      leader = leader_of(std::move(trajectory->path), s.clock, s.rate);
    }
    FoundTrajectory& found = trajectories_.draft();
    const std::optional<AvoidanceTrajectory> followed_now = s.avoiding ? std::optional(s.trajectory) : std::nullopt;
    const std::optional<AvoidanceTrajectory> best = evasion_->look(followed, s.q, s.v, around, followed_now, leader);
    found.time = s.time;
    found.goal_number = s.goal_number;
    found.avoid = best.has_value();
    if (best) {
      found.trajectory = *best;
    }
    found.duration = std::chrono::duration<double>(std::chrono::steady_clock::now() - s.written).count();
    trajectories_.submit();
  }
}

Posture Controller::Impl::search_posture(const PoseGoal& goal, const Eigen::VectorXd& near, const Obstacles& around,
                                         std::uint64_t attempt, std::uint64_t goal_number) {
  Obstruction obstruction;
  const Eigen::VectorXd& rest = goal.settings.rest;
  PostureSearchSettings search;
  search.starts = attempt == 0 ? posture_starts : posture_starts_again;
  search.seed = settings.seed + attempt;
  search.another = attempt > 0;
  search.limit_room = settings.position_margin + settings.barriers.limit_activation;
  bool free_of_itself = false;
  Posture posture =
      find_posture(arm.robot(), goal, rest.size() == near.size() ? rest : near, search, [&](const Eigen::VectorXd& q) {
        const BodyClearance::Nearest own = body_.nearest(q, Obstacles::none(), 0.0, posture_room_);
        free_of_itself = free_of_itself || own.clearance >= 0.0 || body_.label(own.item).kind == CoordinateLabel::Kind::effort;
        return ends_->obstructed(q, around, obstruction)
                   ? -infinity
                   : std::max(0.0, body_.nearest(q, around, 2.0 * search.room, posture_room_).clearance);
      });
  posture.touches_itself = posture.found() && !free_of_itself;
  const std::lock_guard lock(mutex_);
  if (goal_count_ == goal_number) {
    shown_posture_ = posture;
  }
  return posture;
}

LookAhead::Leader Controller::Impl::leader_of(JointTrajectory path, double clock, double rate) const {
  return [this, path = std::make_shared<const JointTrajectory>(std::move(path)), clock, rate](
             const Eigen::VectorXd& q, const Eigen::VectorXd& v, double duration, Goal& goal) mutable {
    JointGoal& reference = std::get<JointGoal>(goal);
    clock += rate * duration;
    path->sample(clock, reference.position, reference.velocity, reference.acceleration);
    reference.velocity *= rate;
    reference.acceleration *= rate * rate;
    hold_to_path(q, v, reference);
  };
}

LookAhead::Leader Controller::Impl::leader_of(const OnlinePlanner::Following& following) const {
  if (!guide) {
    return {};
  }
  const std::shared_ptr<const TimedPath> route = guide->route(following.route_number);
  if (route == nullptr) {
    return {};
  }
  return [this, route, follower = following.follower, route_settings = guide->settings().route](
             const Eigen::VectorXd& q, const Eigen::VectorXd& v, double duration, Goal& goal) mutable {
    JointGoal& reference = std::get<JointGoal>(goal);
    follower.advance(*route, route_settings, q, duration, reference.position, reference.velocity, reference.acceleration);
    hold_to_path(q, v, reference);
  };
}

}  // namespace sidestep
