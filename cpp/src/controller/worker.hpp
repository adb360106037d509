#pragma once

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <semaphore>
#include <thread>

#include "activation_distances.hpp"
#include "look_ahead_follower.hpp"
#include "goal_follower.hpp"
#include "request_board.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/math/triple_buffer.hpp"

namespace sidestep {

/// What the step tells the worker.
struct Snapshot {
  Snapshot(const Robot& robot, const AvoidanceTrajectory& flight);

  double time = 0.0;
  Eigen::VectorXd q, v;  // State of the reference.
  std::uint64_t request_number = 0, posture_attempt = 0;
  std::uint64_t world_number = 0;
  WorldMotion motion;        // How its obstacles have moved since they were given.
  JointGoal followed;        // Goal by which the reference is led.
  bool by_pose = false;      // the pose goal itself is followed, as it moves
  double request_age = 0.0;  // time for which it has moved [s]
  /// The clock of the trajectory that is followed, which began at q, v.
  struct OnTrajectory {
    bool is = false;
    Eigen::VectorXd q, v;
    double clock = 0.0, rate = 0.0;
  } trajectory;
  OnlinePlanner::Following following;
  Places places;  // Configurations near which activation distances shrink.
  bool avoiding = false;
  AvoidanceTrajectory flight;
  std::chrono::steady_clock::time_point written{};
};

/// The part of the controller beside the loop: postures, activation distances at places, trajectories out of the way.
class Worker {
 public:
  Worker(RequestBoard& board, std::shared_ptr<const GeometricSystem> system, const ActivationDistances& distances,
         const LookAheadFollower& flight, const ControllerSettings& settings, double look_period);
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Begins a thread that looks at what it is told; `goal` and `look_ahead` stay.
  void start(GoalFollower& goal, LookAheadFollower& look_ahead);
  /// Asks the thread to end, and does not wait.
  void retire() noexcept { stopping_.store(true); }
  /// Ends the thread.
  void stop() noexcept;

  /// For the step: fills a snapshot, and tells it. `wakes`: at once.
  Snapshot& draft() noexcept { return snapshots_.draft(); }
  void tell(bool wakes) noexcept;
  /// Activation distances that it found.
  TripleBuffer<FoundActivations>& activations() noexcept { return activations_; }

 private:
  void run(GoalFollower& goal, LookAheadFollower& look_ahead);
  void look(const Snapshot& snapshot, GoalFollower& goal, LookAheadFollower& look_ahead);
  void look_for_posture(const Snapshot& snapshot, const PoseGoal& pose, const Obstacles& obstacles, GoalFollower& goal);
  void look_ahead_from(const Snapshot& snapshot, Request& request, const Obstacles& obstacles, const GoalFollower& goal,
                       LookAheadFollower& look_ahead);
  /// The planner gets obstacles that have moved since it got them.
  void share_with(OnlinePlanner& planner, const Snapshot& snapshot, const Obstacles& obstacles);
  /// The newest obstacles, where those of the snapshot have moved to.
  Obstacles obstacles_at(const Snapshot& snapshot) const;

  RequestBoard& board_;
  const ActivationDistances& distances_;
  const ControllerSettings& settings_;
  const double look_period_;
  GeometricSystem::Workspace workspace_;
  TripleBuffer<Snapshot> snapshots_;
  TripleBuffer<FoundActivations> activations_;
  std::uint64_t shared_world_ = 0;  // Number of the obstacles that the planner has, as they are where nothing moves.
  WorldMotion shared_motion_;       // their motion then
  std::uint64_t sought_request_ = 0, sought_attempt_ = 0;
  double next_trajectory_ = 0.0;  // [s]
  std::counting_semaphore<> wake_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sidestep
