#include "sidestep/body/body.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

namespace sidestep {
namespace {
// Deviation of the sum of weights from one: they may have been stored in single precision.
constexpr double weight_sum_tolerance = 1e-6;
constexpr double symmetry_tolerance = 1e-9;  // Relative asymmetry of a covariance: rounding of a symmetrised product.
}  // namespace

Body::Body(std::vector<std::string> links_, Eigen::VectorXd weights_, Eigen::Matrix3Xd means_,
           std::vector<Eigen::Matrix3d> covariances_, Eigen::VectorXd levels_)
    : links(std::move(links_)),
      weights(std::move(weights_)),
      means(std::move(means_)),
      covariances(std::move(covariances_)),
      levels(std::move(levels_)) {
  const auto num = static_cast<Eigen::Index>(links.size());
  if (num == 0) {
    throw std::invalid_argument("body has no Gaussian component");
  }
  if (weights.size() != num || means.cols() != num || static_cast<Eigen::Index>(covariances.size()) != num) {
    throw std::invalid_argument("body has " + std::to_string(num) + " links, " + std::to_string(weights.size()) + " weights, " +
                                std::to_string(means.cols()) + " means and " + std::to_string(covariances.size()) +
                                " covariances; the numbers must be equal");
  }
  if (levels.size() != 0 && levels.size() != num) {
    throw std::invalid_argument("body has " + std::to_string(num) + " components and " + std::to_string(levels.size()) +
                                " levels; give one each, or none");
  }
  std::map<std::string, double> weight_of_link;
  for (Eigen::Index k = 0; k < num; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const std::string owner = "component " + std::to_string(k) + " (link '" + links[i] + "'): ";
    if (!(weights[k] > 0.0) || !std::isfinite(weights[k])) {
      throw std::invalid_argument(owner + "weight " + std::to_string(weights[k]) + " must be positive");
    }
    if (!means.col(k).allFinite()) {
      throw std::invalid_argument(owner + "mean is not finite");
    }
    const Eigen::Matrix3d& covariance = covariances[i];
    if (!covariance.allFinite() || !covariance.isApprox(covariance.transpose(), symmetry_tolerance) ||
        covariance.llt().info() != Eigen::Success) {
      throw std::invalid_argument(owner + "covariance must be symmetric positive definite");
    }
    if (levels.size() != 0 && (!(levels[k] > 0.0) || !std::isfinite(levels[k]))) {
      throw std::invalid_argument(owner + "level " + std::to_string(levels[k]) + " must be positive and finite");
    }
    weight_of_link[links[i]] += weights[k];
  }
  for (const auto& [link, sum] : weight_of_link) {
    if (std::abs(sum - 1.0) > weight_sum_tolerance) {
      throw std::invalid_argument("weights of link '" + link + "' sum to " + std::to_string(sum) + ", must be 1");
    }
  }
}

}  // namespace sidestep
