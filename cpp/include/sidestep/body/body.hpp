#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace sidestep {

/// A Gaussian mixture per link: component k sits on frame `links[k]` and is constant there.
///
/// weights (K,), sum 1 per link; means (3 × K) [m]; covariances (K of 3 × 3) [m^2], symmetric positive definite.
/// A calibrated body has levels (K,), positive: its link lies inside the union of the ellipsoids
/// (y − mean)ᵀ covariance⁻¹ (y − mean) <= level. Without calibration levels is empty.
struct Body {
  std::vector<std::string> links;
  Eigen::VectorXd weights;
  Eigen::Matrix3Xd means;
  std::vector<Eigen::Matrix3d> covariances;
  Eigen::VectorXd levels;

  /// Throws std::invalid_argument that names the component and the quantity at fault.
  Body(std::vector<std::string> links, Eigen::VectorXd weights, Eigen::Matrix3Xd means,
       std::vector<Eigen::Matrix3d> covariances, Eigen::VectorXd levels = {});

  int num_components() const noexcept { return static_cast<int>(links.size()); }
};

}  // namespace sidestep
