#pragma once

#include <Eigen/Core>
#include <string>

namespace sidestep {

/// Largest entry of R^T R - 1 that a rotation R may have: matrices may have gone through single precision.
inline constexpr double rotation_tolerance = 1e-6;
/// Largest entry of R^T R - 1 that counts as rounding: a quaternion of three digits has up to 0.008.
inline constexpr double rotation_rounding = 0.01;

/// The largest entry of |R^T R - 1|: how far a matrix is from a rotation, or from one that mirrors.
double rotation_defect(const Eigen::Matrix3d& matrix) noexcept;

/// The rotation that is nearest to a matrix in the Frobenius norm (Higham 1986): of one whose digits were rounded.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

/// Throws std::invalid_argument that says by how much R, the upper left block of a pose, is no rotation; `owner`: of the pose. Entries
/// that are not finite are left to others.
void check_rotation(const Eigen::Matrix3d& R, const std::string& owner);

}  // namespace sidestep
