#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/dynamical_system/rollout.hpp"

namespace sidestep {

/// One step at each of N states: row k belongs to state k.
struct BatchEvaluation {
  Eigen::MatrixXd accelerations;     ///< (N, nv) [rad/s²]
  Eigen::MatrixXd values;            ///< ψ (N, m), NaN where the step fell back
  std::vector<StepStatus> statuses;  ///< (N)
};

/// The step of the system at states q, v (N, nv) towards goals (N, nv), on `threads` threads (0: one per processor). Where
/// StepBlock takes the system, states are taken side by side: as single steps within rounding, wherever they stand.
/// Throws std::invalid_argument on sizes or a number of threads that is not from 0 to 1024, and Interruption if interrupted,
/// which the calling thread asks.
BatchEvaluation evaluate_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                               const Eigen::MatrixXd& goals, const Obstacles& obstacles, int threads = 0,
                               const Interrupted& interrupted = never_interrupted);

/// The motions from q, v (N, nv) towards goals (N, nv), on `threads` threads (0: one per processor); each as `rollout`
/// gives it, whatever the number of threads: exactly, or, where StepBlock takes the system, within rounding of every step. With
/// a filter, with steps timed and with runge_kutta_4 motions are not taken side by side. Throws std::invalid_argument as `rollout` does, on sizes, on a number
/// of threads that is not from 0 to 1024, and if the settings hold an escape, which belongs to one motion; Interruption if
/// interrupted, which the calling thread asks.
std::vector<Rollout> rollout_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                   const Eigen::MatrixXd& goals, const Obstacles& obstacles,
                                   const RolloutSettings& settings, int threads = 0);

}  // namespace sidestep
