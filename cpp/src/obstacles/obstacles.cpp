#include "sidestep/obstacles/obstacles.hpp"

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "../finite.hpp"

namespace sidestep {
Obstacles::Obstacles(Eigen::Matrix3Xd points, Eigen::VectorXd radii, Eigen::Matrix3Xd velocities)
    : points_(std::move(points)), radii_(std::move(radii)), velocities_(std::move(velocities)) {
  const Eigen::Index num = points_.cols();
  if (num == 0) {
    throw std::invalid_argument(
        "obstacles: the cloud is empty; a sensor that sees nothing is not a free workspace. "
        "Use Obstacles.none() if the workspace is known to be free");
  }
  if (radii_.size() != num || velocities_.cols() != num) {
    throw std::invalid_argument("obstacles: " + std::to_string(num) + " points, " + std::to_string(radii_.size()) +
                                " radii and " + std::to_string(velocities_.cols()) +
                                " velocities; the numbers must be equal");
  }
  for (Eigen::Index i = 0; i < num; ++i) {
    const auto owner = [i] { return "obstacles: point " + std::to_string(i); };
    if (!points_.col(i).allFinite()) {
      throw std::invalid_argument(owner() + " is not finite");
    }
    if (!(radii_[i] >= 0.0) || !(radii_[i] <= largest_radius)) {
      throw std::invalid_argument(owner() + " has radius " + std::to_string(radii_[i]) +
                                  ", must be finite, >= 0 and at most 1e9 m");
    }
    if (!velocities_.col(i).allFinite()) {
      throw std::invalid_argument(owner() + " has a velocity that is not finite");
    }
  }
  tree_ = PointTree(points_, radii_, velocities_);
}

bool Obstacles::advance(double duration) noexcept {
  if (!std::isfinite(duration)) {
    return false;
  }
  if (!tree_.moves()) {
    return true;
  }
  if (!all_finite(points_ + duration * velocities_)) {
    return false;
  }
  points_ += duration * velocities_;
  tree_.advance(duration);
  version_ = next_version();
  return true;
}

std::uint64_t Obstacles::next_version() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace sidestep
