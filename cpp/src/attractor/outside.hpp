#pragma once

#include <Eigen/Core>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Whether a configuration, finite, is outside the position limits by more than `tolerance` [rad | m]. `nv` is from
/// with_size.
template <class Vector, class Size>
bool is_outside(const Eigen::MatrixBase<Vector>& q, const JointLimits& limits, Size nv, double tolerance = 0.0) noexcept {
  return (q - sized(limits.lower, nv)).cwiseMin(sized(limits.upper, nv) - q).minCoeff() < -tolerance;
}

}  // namespace sidestep
