#pragma once

#include <Eigen/Core>

namespace sidestep {

/// The gap between two ellipsoids and the unit vector along it.
///
/// With centres d apart and half-widths s(n) = √(nᵀ S n) the gap is
///
///     h = max over |n| = 1 of φ(n),      φ(n) = n·d − s_a(n) − s_b(n):
///
/// the distance of ellipsoids that are apart. Of those that overlap it is less than zero: minus the depth, or where d is
/// much shorter than the semi-axes, that of a maximum near the line of centres. φ of any n is a lower bound of h.
struct EllipsoidGap {
  double value;            ///< h [m]
  Eigen::Vector3d normal;  ///< n, from a to b

  Eigen::Matrix<double, 3, 2> tangents;  ///< two unit vectors across n
  Eigen::Matrix2d curvature;             ///< −∂²φ across n: positive definite

  /// How n moves (3) where ∂φ across n moves by `gradient_rate` (3).
  Eigen::Vector3d turn(const Eigen::Vector3d& gradient_rate) const noexcept;
};

/// Newton's method on the sphere, from the line of centres: d (3), and S_a and S_b (3 × 3), positive definite, in one
/// frame [m, m²]. Ends after 16 steps at most.
EllipsoidGap ellipsoid_gap(const Eigen::Vector3d& d, const Eigen::Matrix3d& S_a, const Eigen::Matrix3d& S_b) noexcept;

}  // namespace sidestep
