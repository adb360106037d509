#pragma once

#include <Eigen/Core>
#include <optional>

#include "current_request.hpp"
#include "goal_follower.hpp"
#include "joint_kinds.hpp"
#include "measured_state.hpp"
#include "sidestep/controller/command.hpp"
#include "sidestep/controller/posture_search.hpp"
#include "sidestep/controller/settings.hpp"

namespace sidestep {

/// Says what the controller is doing. What changes from one look of the planner to the next is no verdict: the way to a goal has to
/// be the same for a while.
class ActivityJudge {
 public:
  ActivityJudge(const ControllerSettings& settings, const JointKinds& joints, double look_period);

  /// What a step ended with.
  struct Evidence {
    const CurrentRequest& request;
    const Goal& destination;  // a goal that was set, or the motion of an input; only where there is a request
    const GoalFollower& goal;
    const Goal* followed;  // Goal by which the reference is led.
    const MeasuredState& arm;
    const KinematicState& kinematics;  // State of the arm.
    StepStatus attraction;
    const Tick& tick;
    bool stale = false, fresh = false;  // Obstacles are old; velocity or twist is fresh.
    bool under_way = false;             // A trajectory has not ended.
    bool waits = false;                 // A trajectory waits for its path to be free.
    bool target_blocked = false;        // the target is inside a barrier
  };
  struct Verdict {
    Activity activity;
    std::optional<bool> rests = std::nullopt;  // short of a goal that it was on the way to; empty: that does not count
  };
  Verdict judge(const Evidence& now) noexcept;
  /// What an arm does whose state is unusable.
  static Activity without_state(bool stale, bool has_request) noexcept;
  /// Another goal: nothing is known of the way to it.
  void forget(double time) noexcept;
  void go_on_from(const ActivityJudge& before) noexcept { memory_ = before.memory_; }

 private:
  struct Memory {
    Way way = Way::unknown;  // the last that was known
    double since = 0.0;      // [s]
    double settles = 0.0;    // time after which it is reported [s]
    double rest_time = 0.0;  // time for which the arm has rested short of its goal [s]
    bool no_way = false;     // as reported: `way`, once it has settled
  };

  bool is_at_goal(const Evidence& now) const noexcept;
  bool is_at_rest(const Eigen::VectorXd& v) const noexcept;
  /// Follows the way to the goal once it has said the same for a while.
  void settle(const Evidence& now) noexcept;

  const ControllerSettings& settings_;
  const JointKinds& joints_;
  const double look_period_;
  Memory memory_;
};

}  // namespace sidestep
