#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <random>

#include "sidestep/math/vectors.hpp"

namespace sidestep {

/// Writes a configuration (nv) that is uniform within `spread` [rad | m] of q in every joint, and between `lower` and
/// `upper`: the same on every machine, which the standard's distributions are not. No allocation.
inline void random_configuration(std::mt19937_64& random, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                 ConstVectorRef q, double spread, Eigen::VectorXd& configuration) noexcept {
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double low = std::max(lower[j], q[j] - spread), high = std::min(upper[j], q[j] + spread);
    const double share = static_cast<double>(random() >> 11) * 0x1p-53;  // in [0, 1)
    configuration[j] = std::clamp(low + share * (high - low), lower[j], upper[j]);
  }
}

}  // namespace sidestep
