#pragma once

#include <Eigen/Core>

namespace sidestep {

/// The rigid motion nearest to corresponding points by least squares: to ≈ R (from − c) + c + translation, c the centroid of `from`.
struct RigidMotion {
  Eigen::Vector3d translation;  ///< of the centroid [m]
  Eigen::Vector3d rotation;     ///< vector of the turn R [rad]
  double gyration;              ///< root mean square distance of the points from their centroid [m]
  Eigen::VectorXd residual;     ///< (N) distances that are left [m]

  /// (3 × N) both, N >= 1. By the singular values of the covariance (Kabsch 1976). Points on a line turn by the smallest angle.
  RigidMotion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);
};

}  // namespace sidestep
