#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "activation_distances.hpp"
#include "joint_kinds.hpp"
#include "posture_finder.hpp"
#include "reference.hpp"
#include "request_board.hpp"
#include "sidestep/attractor/local_minimum_recovery.hpp"
#include "sidestep/constraints/speed_constraint.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/planning/online_planner.hpp"

namespace sidestep {

/// A posture that a worker found for a pose goal.
struct FoundPosture {
  std::uint64_t request_number = 0, attempt = 0;
  Posture posture;
};

/// The way to a goal at rest, as the planner, the posture search and the barriers know it.
enum class Way { unknown, open, none };

/// What later stages found of the target.
struct TargetFindings {
  bool blocked = false;  // the target is inside a barrier
  bool rests = false;    // the arm rests short of a goal that it was on the way to
};

/// What following a goal remembers from one step to the next, whatever body the arm has.
struct GoalMemory {
  explicit GoalMemory(Eigen::Index nv);

  Eigen::VectorXd target;  // the configuration that the arm is led to
  bool has_target = false;
  bool posture_found = false;  // the target is a posture with the pose, or a joint goal
  bool begins = false;         // a goal was set and has not begun
  bool asks_worker = false;    // A posture is asked of the worker.
  std::uint64_t posture_attempt = 0;
  double next_posture = 0.0;  // time from which another posture is tried [s]
  Goal led;                   // JointGoal: what the reference is led by
};

/// Leads the reference to a goal at rest: by the planner's path, straight, or by a sub-goal out of a local minimum; for a pose by one
/// posture after the other until a way leads to it.
class GoalFollower : private GoalMemory {
 public:
  /// `works`: the planner has a thread of its own unless the controller is synchronous.
  GoalFollower(const ClearanceQuery& body, const ControllerSettings& settings, const JointKinds& joints,
               const std::optional<RigidBodyDynamics>& dynamics, RequestBoard& board, bool works);

  /// The moment of a step.
  struct Moment {
    const Reference& reference;
    const Eigen::VectorXd& arm_q;
    const Obstacles& obstacles;
    const Tick& tick;
    std::uint64_t request_number = 0;
  };

  /// A step begins.
  void begin_step() noexcept { taken_ = {}; }
  /// Another request was taken over; `goal`: it is a goal.
  void leave(bool goal) noexcept;
  /// The motion begins anew: the next step searches a posture and a path from here. `has_goal`: a goal is followed, and no input.
  void begin_anew(bool has_goal) noexcept;
  /// The goal begins, once the state is known. True if a new way must be found.
  bool begin(Goal& goal, bool moves, const Moment& now) noexcept;
  /// The goal that leads the reference now. `pose`: the goal that was set, if it is a pose; `avoids`: the look-ahead leads the arm;
  /// `findings`: as the last step left them, cleared where another posture is tried.
  const Goal& lead(const PoseGoal* pose, const Moment& now, bool avoids, TargetFindings& findings) noexcept;
  /// The reference stays where it is.
  const Goal& rest_at(const Eigen::VectorXd& q) noexcept;
  /// Slows the path so that no frame is faster than `speed_limit` [m/s], and no faster than `pace` in [0, 1].
  void limit_speed(double speed_limit, double pace, const FrameSpeeds& frames) noexcept;
  void limit_pace(double pace) noexcept {
    if (planner_) {
      planner_->limit_pace(pace);
    }
  }
  /// The end of an input is a goal, which begins.
  void begin_next() noexcept { begins = true; }
  /// Another arm takes over: the target stays, and a new way to it is searched. `has_goal_at_rest`: a goal is set and does not move.
  void go_on_from(const GoalFollower& before, bool has_goal_at_rest) noexcept;
  /// Whether the worker is asked for a posture; `take_question` says so once.
  bool asks() const noexcept { return asks_worker; }
  bool take_question() noexcept { return std::exchange(asks_worker, false); }

  /// The way to the goal for an arm that has rested short of it for `rest_time` [s]. `followed`: the goal that leads the reference;
  /// `blocked`: the target is inside a barrier.
  Way way(double rest_time, const Goal* followed, bool blocked) const noexcept;
  /// Whether the arm stops before its target: it goes straight there, and the target is inside something.
  bool stops_short(const Goal* followed, bool blocked) const noexcept;
  /// Writes the configurations near which activation distances shrink.
  void write_places(Places& places) const noexcept;
  /// Where `followed` is on the planner's path; number 0 if it does not follow one.
  OnlinePlanner::Following following(const Goal* followed) const noexcept;
  bool is_on_path(const Goal* followed) const noexcept {
    return planner_ && followed == &led && planner_->following().route_number != 0;
  }
  /// Age of the state that the planner looked at last [s].
  double planner_age(double time) const noexcept { return planner_ && has_target ? planner_->age(time) : 0.0; }

  bool begins_goal() const noexcept { return begins; }
  bool has_planner() const noexcept { return planner_ != nullptr; }
  OnlinePlanner* planner() const noexcept { return planner_.get(); }  // null: none
  OnlinePlannerStatus planner_status() const noexcept { return planner_status_; }
  const Goal* led_goal() const noexcept { return &led; }
  const Eigen::VectorXd& target_position() const noexcept { return target; }
  bool is_led_to_target() const noexcept { return has_target; }
  bool reaches_goal() const noexcept { return posture_found; }  // the target is what was asked for
  std::uint64_t attempt() const noexcept { return posture_attempt; }
  PostureFinder& posture_finder() noexcept { return postures_; }
  TripleBuffer<FoundPosture>& found_postures() noexcept { return found_; }
  /// What the last `lead` took over from other threads; null: nothing. Valid until the next one.
  struct Taken {
    const FoundPosture* posture = nullptr;
    const OnlinePlanner::Answer* answer = nullptr;
    const OnlinePlanner::Looked* look = nullptr;
  };
  const Taken& taken() const noexcept { return taken_; }

 private:
  void next(const PoseGoal& pose, const Moment& now) noexcept;
  void take(const Posture& posture) noexcept;
  /// Takes what the worker found, and goes on to another posture where no way leads to this one.
  void update_posture(const PoseGoal& pose, const Moment& now, TargetFindings& findings) noexcept;

  const ClearanceQuery& body_;
  const ControllerSettings& settings_;
  const JointKinds& joints_;
  RequestBoard& board_;
  PostureFinder postures_;
  TripleBuffer<FoundPosture> found_;
  Taken taken_;
  std::unique_ptr<OnlinePlanner> planner_;  // null: off
  OnlinePlannerStatus planner_status_ = OnlinePlannerStatus::idle;
  OnlinePlanner::Reference path_;
  std::optional<LocalMinimumRecovery> local_minimum_;
  KinematicState on_path_;  // the reference on the planner's path
};

}  // namespace sidestep
