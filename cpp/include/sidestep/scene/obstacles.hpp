#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sidestep/scene/point_tree.hpp"

namespace sidestep {

/// Obstacle points in the world, each a ball with a radius that may be zero, moving with a constant velocity.
class Obstacles {
 public:
  /// Largest radius of a ball [m]: single precision still holds what queries compute from it.
  static constexpr double largest_radius = 1e9;

  /// points (3 × N) [m], radii (N) [m] >= 0 and at most `largest_radius`, velocities (3 × N) [m/s]; all finite and N >=
  /// 1. Throws std::invalid_argument that names the first point at fault. For a free workspace use `none()`.
  Obstacles(Eigen::Matrix3Xd points, Eigen::VectorXd radii, Eigen::Matrix3Xd velocities);

  /// The same points, in a given order of the tree, see PointTree::order. For recordings, whose points may have moved since
  /// the tree was built. Also throws if the order is no permutation of the points.
  static Obstacles in_order(Eigen::Matrix3Xd points, Eigen::VectorXd radii, Eigen::Matrix3Xd velocities,
                            std::vector<int> order);

  /// A workspace that is known to be free.
  static Obstacles none() { return Obstacles(); }

  /// The same points at rest.
  Obstacles frozen() const {
    Obstacles copy = *this;
    copy.velocities_.setZero();
    copy.tree_.freeze();
    return copy;
  }

  Eigen::Index size() const noexcept { return points_.cols(); }
  const Eigen::Matrix3Xd& points() const noexcept { return points_; }
  const Eigen::VectorXd& radii() const noexcept { return radii_; }
  const Eigen::Matrix3Xd& velocities() const noexcept { return velocities_; }

  /// The same points with names of their obstacles: the first counts[0] points belong to names[0], and so on; an empty name is
  /// none. Copies share the names. Throws std::invalid_argument unless there are as many counts as names, none negative, and
  /// their sum is the number of points.
  Obstacles named(std::vector<std::string> names, const std::vector<Eigen::Index>& counts) const;

  /// Name (empty: none) and number of points of each obstacle, in the order of the points.
  std::vector<std::pair<std::string, Eigen::Index>> groups() const;

  /// Name of the obstacle of a point; empty if it has none or there is no such point.
  std::string_view name_of(Eigen::Index point) const noexcept;

  /// Words of messages for the obstacle of a point: "'table'" by its name, "obstacle point 3" without a name, "an obstacle" if
  /// there is no such point.
  std::string words_for(Eigen::Index point) const;

  /// The same points in the order and under the hierarchy that queries use; built at construction.
  const PointTree& tree() const noexcept { return tree_; }

  /// Version number: changes whenever points or radii may have changed; copies keep it. For caches.
  std::uint64_t version() const noexcept { return version_; }

  /// Moves every point along its velocity, x += s * duration. False, and no point moves, if the duration or a result is not
  /// finite. No allocation.
  bool advance(double duration) noexcept;

 private:
  Obstacles() : points_(3, 0), radii_(0), velocities_(3, 0) {}

  static std::uint64_t next_version() noexcept;

  /// names[k] is of the points from ends[k - 1], from 0 for the first, to before ends[k].
  struct Names {
    std::vector<std::string> names;
    std::vector<Eigen::Index> ends;
  };

  Eigen::Matrix3Xd points_;
  Eigen::VectorXd radii_;
  Eigen::Matrix3Xd velocities_;
  PointTree tree_;
  std::shared_ptr<const Names> names_;
  std::uint64_t version_ = next_version();
};

}  // namespace sidestep
