#pragma once

#include <Eigen/Core>
#include <vector>

#include "current_request.hpp"
#include "goal_follower.hpp"
#include "input_target.hpp"
#include "trajectory_follower.hpp"
#include "velocity_follower.hpp"

namespace sidestep {

/// Stage `inputs`: what the reference is led to in this step, by a goal, velocity, twist or trajectory, or to rest.
class InputsStage {
 public:
  InputsStage(RequestBoard& board, const ClearanceQuery& body, const Robot& robot, const JointKinds& joints,
              const ControllerSettings& settings, const UsableLimits& usable, const std::vector<Eigen::Index>& clearances,
              const std::optional<RigidBodyDynamics>& dynamics, bool works);

  /// The moment of a step.
  struct Moment {
    const Reference& reference;
    const Eigen::VectorXd& arm_q;
    const Obstacles& obstacles;
    const NearReference& near;  // as the last step left it
    const Tick& tick;
    double pace = 1.0;
    bool agrees = true;            // the arm is where the reference is; else nothing begins
    bool stale = false;            // the obstacles are old: the arm stops
    bool avoids = false;           // the arm is led out of the way
    TargetFindings findings = {};  // as the last step left them
  };
  struct Target {
    const Goal* followed = nullptr;  // valid until the next step
    bool is_another_way = false;     // than that in the step before has to be found
    TargetFindings findings = {};    // those that still hold
  };

  /// Takes over the newest request: true where it is another one.
  bool update(const Tick& tick) noexcept;
  Target target(const Moment& now) noexcept;
  /// Compares the end of the step with what was asked of it: writes what is changed, see Command::input_change; true where less
  /// is done than asked. `wanted`: the reference's acceleration after barriers; `deviation`: see below.
  bool judge(const Moment& now, const Eigen::VectorXd& wanted, double deviation, Eigen::VectorXd& change) noexcept;
  /// Where the reference is beside a trajectory that has begun [rad | m]; 0 without one.
  double judge_deviation(const Reference& reference) noexcept;
  /// How far the clock of a trajectory that has begun is behind [s]; 0 without one.
  double trajectory_delay() const noexcept {
    return request_.trajectory() == nullptr || request_.begins_input() ? 0.0 : trajectory_.delay();
  }
  /// The motion begins anew.
  void begin_anew() noexcept;
  void go_on_from(InputsStage& before) noexcept;

  const CurrentRequest& request() const noexcept { return request_; }
  const InputTarget& input() const noexcept { return input_; }
  const VelocityFollower& velocity() const noexcept { return velocity_; }
  const TrajectoryFollower& trajectory() const noexcept { return trajectory_; }
  const GoalFollower& goal() const noexcept { return goal_; }
  GoalFollower& goal() noexcept { return goal_; }
  /// The goal that was set, or the motion of an input.
  const Goal& destination() const noexcept { return request_.goal() != nullptr ? *request_.goal() : input_.motion(); }
  /// A velocity or twist is not older than its timeout.
  bool is_fresh() const noexcept { return request_.age() <= settings_.inputs.timeout; }
  /// A trajectory whose path is kept is followed in this step.
  bool keeps_path() const noexcept { return input_.is_followed() && request_.keeps_path(); }
  /// A trajectory is followed that has not ended.
  bool is_under_way() const noexcept;

 private:
  Goal& own_destination() noexcept { return request_.goal() != nullptr ? *request_.goal() : input_.motion(); }
  void begin_input(const Moment& now) noexcept;
  void follow_input(const Moment& now) noexcept;

  const ControllerSettings& settings_;
  CurrentRequest request_;
  InputTarget input_;
  VelocityFollower velocity_;
  TrajectoryFollower trajectory_;
  GoalFollower goal_;
};

}  // namespace sidestep
