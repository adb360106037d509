#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
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
                            Eigen::VectorXd uncertainty, std::vector<int> order);

  /// The points of several sets in their order, with their names; each set is a part, which moves by itself.
  static Obstacles join(const std::vector<const Obstacles*>& sets);

  /// The same points with other velocities (3 × N) [m/s] and their uncertainty (N) [m/s] >= 0. Throws std::invalid_argument unless all are
  /// finite and as many as points.
  Obstacles moving(Eigen::Matrix3Xd velocities, Eigen::VectorXd uncertainty) const;

  /// A workspace that is known to be free.
  static Obstacles none() { return Obstacles(); }

  /// The same points at rest.
  Obstacles frozen() const;

  Eigen::Index size() const noexcept { return points_.cols(); }
  const Eigen::Matrix3Xd& points() const noexcept { return points_; }
  const Eigen::VectorXd& radii() const noexcept { return radii_; }
  const Eigen::Matrix3Xd& velocities() const noexcept { return velocities_; }
  /// How far the true velocity of each point may be from its velocity (N) [m/s].
  const Eigen::VectorXd& uncertainty() const noexcept { return uncertainty_; }
  /// Points that had a velocity when they were given; those of parts that stand still have none now.
  const std::vector<Eigen::Index>& movers() const noexcept { return movers_; }
  /// Number of points before those of part k, 0 <= k <= num_parts(), and of parts: one, unless sets were joined.
  Eigen::Index part_begin(std::size_t k) const noexcept { return begins_[k]; }
  std::size_t num_parts() const noexcept { return begins_.size() - 1; }
  /// The part of a point.
  std::size_t part_of(Eigen::Index point) const noexcept;

  /// The same points with names of their obstacles: the first counts[0] points belong to names[0], and so on; an empty name is
  /// none. Copies share the names. Throws std::invalid_argument unless there are as many counts as names, none negative, and
  /// their sum is the number of points. `poses`: of each in the world, by which it can be moved; empty: all at the origin.
  Obstacles named(std::vector<std::string> names, const std::vector<Eigen::Index>& counts,
                  std::vector<Eigen::Isometry3d> poses = {}) const;
  /// Pose of group k in the world.
  Eigen::Isometry3d pose_of(std::size_t k) const;

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

  /// Moves every point along its velocity, x += s * duration. False, and no point of a part moves, if the duration or a result of
  /// that part is not finite. No allocation.
  bool advance(double duration) noexcept;
  /// The same of one part.
  bool advance(std::size_t part, double duration) noexcept;
  /// Whether `advance` would change a part.
  bool moves(std::size_t part) const noexcept { return size() > 0 && tree_.parts()[part].fastest > 0.0; }
  /// The points of a part move no more. No allocation.
  void freeze(std::size_t part) noexcept;
  /// The points of a part are out of every reach, for good: they keep their numbers. No allocation.
  void hide(std::size_t part) noexcept;

 private:
  Obstacles() : points_(3, 0), radii_(0), velocities_(3, 0), uncertainty_(0), begins_{0, 0}, mover_begins_{0, 0} {}

  static std::uint64_t next_version() noexcept;
  void find_movers();

  /// names[k] is of the points from ends[k - 1], from 0 for the first, to before ends[k].
  struct Names {
    std::vector<std::string> names;
    std::vector<Eigen::Index> ends;
    std::vector<Eigen::Isometry3d> poses;
  };

  Eigen::Matrix3Xd points_;
  Eigen::VectorXd radii_;
  Eigen::Matrix3Xd velocities_;
  Eigen::VectorXd uncertainty_;
  std::vector<Eigen::Index> begins_;        // Number of points before those of each part, and of all.
  std::vector<Eigen::Index> movers_;        // Points with a velocity, part by part.
  std::vector<Eigen::Index> mover_begins_;  // Number of movers before those of each part, and of all.
  PointTree tree_;
  std::shared_ptr<const Names> names_;
  std::uint64_t version_ = next_version();
};

}  // namespace sidestep
