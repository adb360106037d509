#pragma once

#include <Eigen/Core>

#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

/// Whether a configuration is outside the position limits.
inline bool is_outside(const Eigen::Ref<const Eigen::VectorXd>& q, const JointLimits& limits) noexcept {
  bool outside = false;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    outside |= q[i] < limits.lower[i] || q[i] > limits.upper[i];
  }
  return outside;
}

}  // namespace sidestep
