#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sidestep/obstacles/obstacles.hpp"

namespace sidestep {

/// A uniform grid over obstacle points, for those near a place. Made off the loop, then immutable: queries allocate
/// nothing, lock nothing and may run in any number of threads.
///
/// Points are kept cell by cell, x fastest, so that a row of cells is one run of memory and a query visits a few runs.
class PointIndex {
 public:
  /// cell [m]: edge of the cells, enlarged where the grid would have more than `max_cells` of them; 0 takes an edge by
  /// the number of points and their extent. Throws std::invalid_argument if it is negative or not finite.
  explicit PointIndex(const Obstacles& obstacles, double cell = 0.0);

  Eigen::Index size() const noexcept { return static_cast<Eigen::Index>(order_.size()); }
  double cell() const noexcept { return cell_; }
  double largest_radius() const noexcept { return largest_radius_; }

  /// A point as it is stored: the place, the radius of its ball, and which obstacle point it is.
  struct Point {
    double x, y, z, radius;
    int index;
  };
  Point point(Eigen::Index k) const noexcept {
    const auto i = static_cast<std::size_t>(k);
    return {x_[i], y_[i], z_[i], radius_[i], order_[i]};
  }

  /// Calls `visit(first, last)` for runs [first, last) of stored points that hold every point whose ball comes within
  /// `distance` of `centre`, and others; ends when it returns true. Returns whether it did.
  template <typename Visit>
  bool for_each_run(const Eigen::Vector3d& centre, double distance, Visit&& visit) const noexcept {
    const double reach = distance + largest_radius_;
    if (order_.empty() || !(reach >= 0.0)) {
      return false;
    }
    std::array<int, 3> low, high;
    for (int i = 0; i < 3; ++i) {
      const double from = (centre[i] - reach - origin_[i]) * per_cell_, to = (centre[i] + reach - origin_[i]) * per_cell_;
      if (!(to >= 0.0) || !(from < cells_[static_cast<std::size_t>(i)])) {
        return false;
      }
      low[static_cast<std::size_t>(i)] = from <= 0.0 ? 0 : static_cast<int>(from);
      high[static_cast<std::size_t>(i)] = static_cast<int>(std::min(to, cells_[static_cast<std::size_t>(i)] - 1.0));
    }
    const int nx = cells_[0], ny = cells_[1];
    for (int z = low[2]; z <= high[2]; ++z) {
      for (int y = low[1]; y <= high[1]; ++y) {
        const auto row = static_cast<std::size_t>((z * ny + y)) * static_cast<std::size_t>(nx);
        const std::int32_t first = starts_[row + static_cast<std::size_t>(low[0])];
        const std::int32_t last = starts_[row + static_cast<std::size_t>(high[0]) + 1];
        if (first < last && visit(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(last))) {
          return true;
        }
      }
    }
    return false;
  }

  /// Calls `visit(point)` for every point whose ball comes within `distance` of `centre`; ends when it returns true.
  /// Returns whether it did.
  template <typename Visit>
  bool for_each_within(const Eigen::Vector3d& centre, double distance, Visit&& visit) const noexcept {
    return for_each_run(centre, distance, [&](Eigen::Index first, Eigen::Index last) {
      for (Eigen::Index k = first; k < last; ++k) {
        const Point p = point(k);
        const double dx = p.x - centre[0], dy = p.y - centre[1], dz = p.z - centre[2], cut = distance + p.radius;
        if (cut >= 0.0 && dx * dx + dy * dy + dz * dz <= cut * cut && visit(p)) {
          return true;
        }
      }
      return false;
    });
  }

  /// Whether the ball of any point comes within `distance` of `centre`.
  bool any_within(const Eigen::Vector3d& centre, double distance) const noexcept {
    return for_each_within(centre, distance, [](const Point&) { return true; });
  }

  static constexpr int max_cells = 1 << 18;

 private:
  double cell_ = 1.0, per_cell_ = 1.0, largest_radius_ = 0.0;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::array<int, 3> cells_{0, 0, 0};
  std::vector<std::int32_t> starts_;  // per cell, and one more: where its points begin
  std::vector<double> x_, y_, z_, radius_;
  std::vector<int> order_;
};

}  // namespace sidestep
