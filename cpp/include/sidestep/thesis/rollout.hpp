#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// Integration scheme of a step of length dt.
enum class Integrator {
  semi_implicit_euler,  ///< Semi-implicit Euler: v ← v + a dt, q ← q + v dt.
  second_order,         ///< The thesis's update (6.2.1): q ← q + v dt + ½ a dt², v ← v + a dt; of first order, as v is.
  runge_kutta_4,        ///< The classical scheme on (q, v), with the obstacles moved along.
};

struct RolloutSettings {
  double period = 0.001;  ///< Time step dt [s].
  int steps = 1000;
  Integrator integrator = Integrator::semi_implicit_euler;
  bool time_steps = false;                      ///< Whether to measure the computing time of each step.
  Interrupted interrupted = never_interrupted;  ///< Asked before every step; ends the rollout when true.
};

/// A kinematic motion of the system: row k is at time k dt; there are steps + 1 rows.
struct Rollout {
  Eigen::VectorXd time;                ///< Times [s].
  Eigen::MatrixXd q, v, acceleration;  ///< States and accelerations (steps + 1, nv).
  Eigen::MatrixXd values;              ///< Values ψ (steps + 1, m), NaN where the step fell back.
  Eigen::MatrixXd switch_weights;      ///< Switch weights (steps + 1, nv), NaN likewise.
  std::vector<StepStatus> statuses;    ///< Status of each row.
  Eigen::VectorXd step_seconds;        ///< Computing time of each row's acceleration [s]; empty if not measured.
};

/// Integrates the system alone from (q, v), with obstacles and goal at constant velocity. Nothing enforces limits or clearances;
/// a Controller does, see `integrate`.
/// Throws std::invalid_argument on sizes, a period or number of steps that is not positive, and a record of more than
/// 8 GiB; Interruption if interrupted.
Rollout rollout(const GeometricSystem& system, const Eigen::VectorXd& q, const Eigen::VectorXd& v, Goal goal,
                const Obstacles& obstacles, const RolloutSettings& settings);
inline Rollout rollout(const GeometricSystem& system, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                       const Eigen::VectorXd& goal, const Obstacles& obstacles, const RolloutSettings& settings) {
  return rollout(system, q, v, Goal(JointGoal(goal)), obstacles, settings);
}

}  // namespace sidestep
