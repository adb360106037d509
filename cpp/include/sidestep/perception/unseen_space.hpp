#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sidestep/perception/perception_settings.hpp"
#include "sidestep/perception/voxel_map.hpp"

namespace sidestep {

/// Space that no camera has looked at, within reach of an arm: cells twice as large as voxels.
///
/// A cell counts as seen once an image saw through its middle, or where the arm is or has been, and until `memory` later.
class UnseenSpace {
 public:
  UnseenSpace(const Eigen::Vector3d& centre, double reach, const PerceptionSettings& settings);

  /// Adds what an image saw through. No allocation.
  void add(const SeenImage& seen) noexcept;
  /// Nobody has looked anywhere.
  void forget() noexcept;
  /// The arm is inside of this ellipsoid {p : (p - c)ᵀ S⁻¹ (p - c) <= 1}, S in the world: it counts as seen, with a cell around it.
  void add_arm(const Eigen::Vector3d& centre, const Eigen::Matrix3d& shape, double time) noexcept;

  /// Cells that nobody has seen and that border on seen ones: middles [m]. Their spheres of `radius` leave no gap.
  Eigen::Matrix3Xd border(double time) const;
  double radius() const noexcept { return 0.8661 * edge_; }
  /// Share of the cells within reach that were seen.
  double seen_share(double time) const noexcept;

 private:
  std::size_t index(int i, int j, int k) const noexcept {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(side_) +
           static_cast<std::size_t>(i);
  }
  Eigen::Vector3d middle(int i, int j, int k) const noexcept {
    return corner_ + edge_ * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
  }
  bool is_within(int i, int j, int k) const noexcept { return (middle(i, j, k) - centre_).squaredNorm() <= reach_ * reach_; }
  bool is_seen(std::size_t n, double time) const noexcept { return time - static_cast<double>(seen_[n]) - begin_ <= memory_; }

  Eigen::Vector3d centre_, corner_;
  double reach_, edge_, memory_, begin_ = 0.0;
  int side_;
  std::vector<float> seen_;  // Time at which a cell was last seen [s], after `begin_`.
  bool has_begun_ = false;
};

}  // namespace sidestep
