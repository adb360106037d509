#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

#include "sidestep/scene/balls.hpp"

namespace sidestep {

/// Points under a hierarchy of bounding balls and boxes, so that a query visits only points near it.
///
/// The points are sorted by halving them across the axis along which they spread most, and kept as structure of arrays,
/// padded to whole leaves: point n of the tree is point order()[n] of the input. A leaf holds `leaf_size` consecutive
/// points, a node `fan_out` consecutive nodes below it; there are no pointers. Building sorts and allocates and belongs
/// outside the control loop; moving the points refits the balls in place.
class PointTree {
 public:
  static constexpr int leaf_size = 16;  // Points of a leaf.
  static constexpr int fan_out = 16;    // Nodes below a node.
  static_assert(fan_out == leaf_size);  // one measurement holds as many nodes as points, as bits of half a word

  /// Holds the balls of all points below.
  struct Ball {
    double x, y, z, radius;
  };

  /// A part that moves by itself: all of a tree, or one of those that were joined.
  struct Part {
    int first_leaf = 0, num_leaves = 0;
    int first_moving = 0;  // Leaf from which on its points move; those before rest.
    double fastest = 0.0;  // speed of a point [m/s], at most
  };

  PointTree() = default;
  /// points (3 × N) [m], radii (N) [m], velocities (3 × N) [m/s].
  PointTree(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii, const Eigen::Matrix3Xd& velocities);
  /// The same in an order of the points that is given.
  PointTree(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii, const Eigen::Matrix3Xd& velocities,
            std::vector<int> order);
  /// The same points with other velocities.
  PointTree moving(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii, const Eigen::Matrix3Xd& velocities) const;
  /// One tree over the points of several, each a part; none of a node's leaves belongs to another part. Points are numbered on from
  /// tree to tree. Sorts nothing again.
  static PointTree join(const std::vector<const PointTree*>& trees);

  int size() const noexcept { return num_points_; }
  const std::vector<Part>& parts() const noexcept { return parts_; }
  bool moves() const noexcept { return fastest_ > 0.0; }
  double common_radius() const noexcept { return common_radius_; }  ///< [m] of all points; negative where they differ
  double fastest() const noexcept { return fastest_; }              ///< speed of any point [m/s], at most
  /// Number of the point at each place of the tree; -1: none, which fills up a leaf.
  const std::vector<int>& order() const noexcept { return order_; }
  /// Whether a tree that is made of its points and velocities as they are now has this order; false where that is not known.
  bool is_in_usual_order() const noexcept { return in_usual_order_; }

  /// Coordinates [m], radii [m] and velocities [m/s] in tree order; points that fill up the last leaf lie at `padding`.
  const double* coordinate(int axis) const noexcept { return columns_[static_cast<std::size_t>(axis)].data(); }
  const double* radii() const noexcept { return columns_[3].data(); }
  const double* velocity(int axis) const noexcept { return columns_[static_cast<std::size_t>(4 + axis)].data(); }
  static constexpr double padding = 1e9;  ///< Coordinate of padding points [m], beyond every reach.

  /// Balls of the leaves, with the centres of their boxes; leaf k holds the points from k `leaf_size` on. Not for a tree
  /// without points.
  Balls leaf_balls() const noexcept { return levels_.front().balls(); }
  Boxes leaf_boxes() const noexcept { return levels_.front().boxes(); }

  struct Nearest {
    double distance;
    int point;  ///< Index in tree order; -1: none.
  };

  /// The point whose ball is nearest by a measure, searched best first.
  ///
  /// measure(Balls, first, count, limit, values) writes the distances of balls [first, first + count), at most `leaf_size`,
  /// into `values` and returns those below `limit` as bits. measure(Boxes, ...) does the same for boxes; their distance may
  /// exceed that of a ball inside only by an error that the caller accepts. (Boxes lie close to walls, while balls around many
  /// of their points would reach far out.) Arrays extend for `leaf_size` from `first`. Points from `limit` on are not found;
  /// any point below `stop` ends the search. No allocation.
  template <class Measure>
  Nearest nearest(double limit, double stop, Measure&& measure) const noexcept {
    Nearest found{limit, -1};
    if (!levels_.empty()) {
      const std::size_t top = top_level(leaf_size);
      descend_to_nearest(top, 0, levels_[top].size, stop, measure, found);
    }
    return found;
  }

  /// Moves every point of a part along its velocity and refits. No allocation.
  void advance(std::size_t part, double duration) noexcept;
  /// Stops every point of a part.
  void freeze(std::size_t part) noexcept;
  /// Moves every point of a part out of every reach, for good. No allocation.
  void hide(std::size_t part) noexcept;

  /// Measures of up to `fan_out` nodes.
  using Bounds = std::array<float, fan_out>;

  /// Calls leaves(first, bits) for every group of leaves with some that matter, nodes of the smallest measure first.
  ///
  /// measure(Balls, Boxes, first, count, Bounds&) measures the nodes [first, first + count), whose arrays extend for `fan_out`
  /// from `first`, and returns those that matter as bits. leaves(...) gets these bits; the upper half of the word may hold
  /// more. No allocation.
  template <class Measure, class Leaves>
  void visit(Measure&& measure, Leaves&& leaves) const noexcept {
    if (!levels_.empty()) {
      const std::size_t top = top_level(fan_out);
      descend(top, 0, levels_[top].size, measure, leaves);
    }
  }
  /// Number of points of a leaf.
  int count(int leaf) const noexcept { return counts_[static_cast<std::size_t>(leaf)]; }

 private:
  /// The balls and boxes of all nodes, around the same centres, with space to read whole groups of `fan_out` nodes.
  struct Level {
    int size;
    std::array<std::vector<double>, 3> centre, half;  // Centres and half sizes of the boxes around the points.
    std::vector<double> largest;                      // Largest radius of a point.
    std::vector<double> radius;                       // Radii of the balls.

    explicit Level(int count);
    Boxes boxes() const noexcept {
      return {centre[0].data(), centre[1].data(), centre[2].data(), half[0].data(),
              half[1].data(),   half[2].data(),   largest.data()};
    }
    Balls balls() const noexcept { return {centre[0].data(), centre[1].data(), centre[2].data(), radius.data()}; }
    Ball ball(int node) const noexcept {
      const auto n = static_cast<std::size_t>(node);
      return {centre[0][n], centre[1][n], centre[2][n], radius[n]};
    }
  };

  /// The lowest level that one measurement holds.
  std::size_t top_level(int most) const noexcept {
    std::size_t top = levels_.size() - 1;
    while (top > 0 && levels_[top - 1].size <= most) {
      --top;
    }
    return top;
  }

  /// Makes the levels above `num_leaves` leaves, and fits them.
  void build(std::size_t num_leaves);
  /// Fits the leaves from `first` to before `end`, and all nodes above them.
  void refit(int first, int end) noexcept;
  void fit(std::size_t level, int node) noexcept;
  void find_fastest() noexcept;

  template <class Measure, class Leaves>
  void descend(std::size_t level, int first, int count, Measure& measure, Leaves& leaves) const noexcept {
    const Level& nodes = levels_[level];
    alignas(64) Bounds bounds;
    const unsigned bits = measure(nodes.balls(), nodes.boxes(), first, count, bounds);
    unsigned left = bits & 0xffffu;
    if (left != 0 && level == 0) {
      leaves(first, bits);
      return;
    }
    while (left != 0) {
      int least = std::countr_zero(left);
      for (unsigned rest = left & (left - 1); rest != 0; rest &= rest - 1) {
        const int i = std::countr_zero(rest);
        least = bounds[static_cast<std::size_t>(i)] < bounds[static_cast<std::size_t>(least)] ? i : least;
      }
      left &= ~(1u << least);
      const int below = (first + least) * fan_out;
      descend(level - 1, below, std::min(fan_out, levels_[level - 1].size - below), measure, leaves);
    }
  }

  /// Among the points below nodes [first, first + count) of a level, at most `leaf_size`.
  template <class Measure>
  void descend_to_nearest(std::size_t level, int first, int count, double stop, Measure& measure,
                          Nearest& found) const noexcept {
    alignas(64) std::array<float, leaf_size> values;
    unsigned near = measure(levels_[level].boxes(), first, count, found.distance, values.data());
    while (near != 0 && !(found.distance < stop)) {
      int nearest = std::countr_zero(near);
      for (unsigned left = near & (near - 1); left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        nearest = values[static_cast<std::size_t>(i)] < values[static_cast<std::size_t>(nearest)] ? i : nearest;
      }
      if (!(values[static_cast<std::size_t>(nearest)] < found.distance)) {
        return;
      }
      near &= ~(1u << nearest);
      const int node = first + nearest;
      if (level == 0) {
        look_at_leaf(node, measure, found);
      } else {
        const int below = node * fan_out;
        descend_to_nearest(level - 1, below, std::min(fan_out, levels_[level - 1].size - below), stop, measure, found);
      }
    }
  }

  template <class Measure>
  void look_at_leaf(int node, Measure& measure, Nearest& found) const noexcept {
    alignas(64) std::array<float, leaf_size> values;
    const Balls points{coordinate(0), coordinate(1), coordinate(2), radii()};
    const int first = node * leaf_size;
    unsigned near = measure(points, first, count(node), found.distance, values.data());
    for (; near != 0; near &= near - 1) {
      const int i = std::countr_zero(near);
      if (values[static_cast<std::size_t>(i)] < found.distance) {
        found = {values[static_cast<std::size_t>(i)], first + i};
      }
    }
  }

  static constexpr std::size_t num_columns = 7;
  int num_points_ = 0;
  std::vector<int> order_;
  std::vector<int> counts_;  // Number of points of each leaf.
  std::vector<Part> parts_;
  std::array<std::vector<double>, num_columns> columns_;  // Columns x, y, z, radius, velocity.
  std::vector<Level> levels_;                             // Levels of the tree: leaves first, one node last.
  double fastest_ = 0.0, common_radius_ = -1.0;
  bool in_usual_order_ = false;
};

}  // namespace sidestep
