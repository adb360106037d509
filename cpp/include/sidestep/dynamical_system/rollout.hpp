#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sidestep/control/acceleration_filter.hpp"
#include "sidestep/dynamical_system/escape.hpp"
#include "sidestep/dynamical_system/evasion.hpp"
#include "sidestep/dynamical_system/geometric_system.hpp"
#include "sidestep/interruption.hpp"

namespace sidestep {

/// How a step of length dt is taken.
enum class Integrator {
  semi_implicit_euler,  ///< v ← v + a dt, q ← q + v dt
  second_order,         ///< q ← q + v dt + ½ a dt², v ← v + a dt (the thesis's update, 6.2.1); of first order, as v is
  runge_kutta_4,        ///< the classical scheme on (q, v), with the obstacles moved along
};

struct RolloutSettings {
  double period = 0.001;  ///< dt [s]
  int steps = 1000;
  Integrator integrator = Integrator::semi_implicit_euler;
  bool time_steps = false;  ///< measure each step: the acceleration, and the filter where there is one
  /// What the acceleration passes before it is applied; none if empty. Of the same period, and not with runge_kutta_4,
  /// whose stages are not held.
  std::optional<AccelerationFilter> filter = {};
  /// Sub-goals where the motion is stuck; none if null. It keeps its state, so that a rollout can go on in a next one: the
  /// last row, which is the first of that one, follows what the row before it did.
  Escape* escape = nullptr;
  /// Flights out of the way of what moves on the way to the goal (not to a sub-goal); none if null. With a filter. While one
  /// is followed, the escape is not asked, and the system's step is that towards its refuge.
  Evasion* evasion = nullptr;
  Interrupted interrupted = never_interrupted;  ///< asked before every step
};

/// [bytes] that the records of one call may have together: 8 GiB.
inline constexpr double most_record_bytes = 8.0 * 1024.0 * 1024.0 * 1024.0;

/// A kinematic motion of the system: row k is at time k dt; there are steps + 1 rows.
struct Rollout {
  Eigen::VectorXd time;                ///< [s]
  Eigen::MatrixXd q, v, acceleration;  ///< (steps + 1, nv); the acceleration applied, filtered if there is a filter
  Eigen::MatrixXd values;              ///< ψ (steps + 1, m), NaN where the step fell back
  Eigen::MatrixXd switch_weights;      ///< (steps + 1, nv), the same
  std::vector<StepStatus> statuses;    ///< one per row
  Eigen::VectorXd step_seconds;        ///< [s] that the acceleration of each row took; empty if not asked for
  std::vector<TorqueStatus> filter_statuses;  ///< one per row; empty without a filter
  Eigen::VectorXd safety_slack;        ///< largest shortfall of a row's clearances [m/s²]; empty without a filter
};

/// Integrates the system from (q, v), obstacles and goal moving at their velocities.
/// Throws std::invalid_argument on sizes, a period or number of steps that is not positive, and a record of more than
/// `most_record_bytes`; Interruption if interrupted.
Rollout rollout(const GeometricSystem& system, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                Goal goal, const Obstacles& obstacles, const RolloutSettings& settings);
inline Rollout rollout(const GeometricSystem& system, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                       const Eigen::VectorXd& goal, const Obstacles& obstacles, const RolloutSettings& settings) {
  return rollout(system, q, v, Goal(JointGoal(goal)), obstacles, settings);
}

}  // namespace sidestep
