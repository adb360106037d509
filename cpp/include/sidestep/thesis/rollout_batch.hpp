#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/thesis/rollout.hpp"

namespace sidestep {

/// The motions from q, v (N, nv) towards goals (N, nv), on `threads` threads (0: one per processor); each exactly as
/// `rollout` gives it, whatever the number of threads. Throws std::invalid_argument as `rollout` does, on sizes, and on
/// a number of threads that is not from 0 to 1024; Interruption if interrupted, which the calling thread asks.
std::vector<Rollout> rollout_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                   const Eigen::MatrixXd& goals, const Obstacles& obstacles, const RolloutSettings& settings,
                                   int threads = 0);

}  // namespace sidestep
