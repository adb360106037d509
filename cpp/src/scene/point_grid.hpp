#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "cell_table.hpp"

namespace sidestep {

/// Points sorted into cells: finds the nearest one within an edge, and what is connected.
class PointGrid {
 public:
  static constexpr double edge = 0.03;  ///< Edge of a cell [m]: clusters are at least as far apart.

  PointGrid() = default;
  /// points (3 × N) [m].
  explicit PointGrid(const Eigen::Matrix3Xd& points);

  struct Nearest {
    int point;        ///< -1: none within an edge
    double distance;  ///< [m]
  };
  Nearest nearest(const Eigen::Vector3d& place) const noexcept;

  Eigen::Vector3d point(int index) const noexcept { return points_.col(index); }

  /// Clusters of the points that are not left out: points of cells that touch are of one cluster. Point indices of each.
  std::vector<std::vector<int>> clusters(const std::vector<char>& left_out) const;

 private:
  std::span<const int> points_in(int cell) const noexcept {
    const auto k = static_cast<std::size_t>(cell);
    return {order_.data() + begins_[k], static_cast<std::size_t>(begins_[k + 1] - begins_[k])};
  }

  Eigen::Matrix3Xd points_;
  CellTable table_;
  std::vector<Cell> cells_;
  std::vector<int> begins_, order_;  // points of cell k: order_[begins_[k]] to before order_[begins_[k + 1]]
};

}  // namespace sidestep
