#pragma once

#include <Eigen/Core>
#include <cmath>

namespace sidestep {

/// Shape matrix of an ellipsoid that holds all points within δ of the one of a shape matrix S: (1 + δ/a) S + (1 + a/δ) δ² I with the mean
/// semi-axis a.
inline Eigen::Matrix3d grown_shape(const Eigen::Matrix3d& shape, double growth) noexcept {
  const double mean_axis = std::sqrt(shape.trace() / 3.0);
  return (1.0 + growth / mean_axis) * shape + (growth + mean_axis) * growth * Eigen::Matrix3d::Identity();
}

}  // namespace sidestep
