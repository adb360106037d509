#include "worker.hpp"

#include <optional>
#include <utility>

#include "path_hold.hpp"

namespace sidestep {

Snapshot::Snapshot(const Robot& robot, const AvoidanceTrajectory& first)
    : q(Eigen::VectorXd::Zero(robot.num_coordinates())),
      v(q),
      followed(q),
      trajectory{false, q, q, 0.0, 0.0},
      places(q.size()),
      flight(first) {}

Worker::Worker(RequestBoard& board, std::shared_ptr<const GeometricSystem> system, const ActivationDistances& distances,
               const LookAheadFollower& flight, const ControllerSettings& settings, double look_period)
    : board_(board),
      distances_(distances),
      settings_(settings),
      look_period_(look_period),
      workspace_(*system),
      snapshots_(Snapshot(system->robot(), flight.followed())),
      activations_(FoundActivations{0, 0, system->activations()}) {}

void Worker::start(GoalFollower& goal, LookAheadFollower& look_ahead) {
  thread_ = std::thread([this, &goal, &look_ahead] { run(goal, look_ahead); });
}

void Worker::stop() noexcept {
  stopping_.store(true);
  wake_.release();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Worker::tell(bool wakes) noexcept {
  snapshots_.submit();
  if (wakes) {
    wake_.release();
  }
}

void Worker::run(GoalFollower& goal, LookAheadFollower& look_ahead) {
  while (!stopping_.load()) {
    static_cast<void>(wake_.try_acquire_for(std::chrono::duration<double>(look_period_)));
    if (snapshots_.update() && !stopping_.load()) {
      board_.guarded([&] { look(snapshots_.current(), goal, look_ahead); });
    }
  }
}

Obstacles Worker::obstacles_at(const Snapshot& snapshot) const {
  const std::shared_ptr<const World> newest = board_.newest_world();
  Obstacles now = newest->obstacles;
  if (newest->number == snapshot.world_number) {
    snapshot.motion.apply(now);
  }
  return now;
}

void Worker::share_with(OnlinePlanner& planner, const Snapshot& s, const Obstacles& obstacles) {
  const bool moved = shared_world_ == s.world_number ? s.motion != shared_motion_ : s.motion != WorldMotion();
  if (moved) {
    board_.share_if_newest(s.world_number, [&] { planner.set_obstacles(obstacles); });
  }
  shared_world_ = s.world_number;
  shared_motion_ = s.motion;
}

void Worker::look(const Snapshot& s, GoalFollower& goal, LookAheadFollower& look_ahead) {
  Request request = board_.request(s.request_number);
  const Obstacles obstacles = obstacles_at(s);
  if (goal.has_planner()) {
    share_with(*goal.planner(), s, obstacles);
  }
  if (const auto* set = std::get_if<Goal>(&request)) {
    if (const auto* pose = std::get_if<PoseGoal>(set); pose != nullptr && !is_moving(*pose)) {
      look_for_posture(s, *pose, obstacles, goal);
    }
  }
  if (settings_.local_activation && s.places.num > 0) {
    FoundActivations& found = activations_.draft();
    found.request_number = s.request_number;
    found.posture_attempt = s.posture_attempt;
    found.target_blocked = distances_.lower_at(s.places, obstacles, workspace_, found.values);
    activations_.submit();
  }
  if (look_ahead.is_on() && s.time >= next_trajectory_) {
    next_trajectory_ = s.time + settings_.look_ahead->delay - 0.5 * look_period_;
    look_ahead_from(s, request, obstacles, goal, look_ahead);
  }
}

void Worker::look_for_posture(const Snapshot& s, const PoseGoal& pose, const Obstacles& obstacles, GoalFollower& goal) {
  if (sought_request_ == s.request_number && sought_attempt_ == s.posture_attempt) {
    return;
  }
  FoundPosture& found = goal.found_postures().draft();
  found = {s.request_number, s.posture_attempt, goal.posture_finder().find(pose, s.q, obstacles, s.posture_attempt)};
  board_.show_posture(s.request_number, found.posture);
  goal.found_postures().submit();
  sought_request_ = s.request_number;
  sought_attempt_ = s.posture_attempt;
}

void Worker::look_ahead_from(const Snapshot& s, Request& request, const Obstacles& obstacles, const GoalFollower& goal,
                             LookAheadFollower& look_ahead) {
  Goal followed = s.followed;
  if (const auto* set = std::get_if<Goal>(&request); s.by_pose && set != nullptr && std::holds_alternative<PoseGoal>(*set)) {
    followed = *set;
    advance(followed, s.request_age);
  }
  LookAhead::Leader leader;
  if (goal.has_planner()) {
    leader = leader_along(settings_, *goal.planner(), s.following);
  }
  if (auto* trajectory = std::get_if<TrajectoryRequest>(&request); trajectory != nullptr && s.trajectory.is) {
    trajectory->path.begin_at(s.trajectory.q, s.trajectory.v);
    leader = leader_along(settings_, std::move(trajectory->path), s.trajectory.clock, s.trajectory.rate);
  }
  FoundTrajectory& found = look_ahead.buffer().draft();
  const std::optional<AvoidanceTrajectory> followed_now = s.avoiding ? std::optional(s.flight) : std::nullopt;
  const std::optional<AvoidanceTrajectory> best =
      look_ahead.look_ahead().update(followed, s.q, s.v, obstacles, followed_now, leader);
  found.time = s.time;
  found.request_number = s.request_number;
  found.avoid = best.has_value();
  if (best) {
    found.trajectory = *best;
  }
  found.duration = std::chrono::duration<double>(std::chrono::steady_clock::now() - s.written).count();
  look_ahead.buffer().submit();
}

}  // namespace sidestep
