#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace sidestep {

/// Three cubes around a point, divided into cells: fine ones near it, coarser ones farther away.
class VoxelGrid {
 public:
  static constexpr int num_levels = 3;
  static constexpr std::array<double, num_levels> scales{1.0, 2.0,
                                                         4.0};  ///< Edges of the levels' cells, in those of the first.

  /// Cells of the edge `voxel` [m] up to `fine` [m] from the centre along each axis, coarser ones up to `far` [m].
  VoxelGrid(const Eigen::Vector3d& centre, double fine, double far, double voxel);

  /// Number of a point's cell, -1: outside.
  int cell(const float* p) const noexcept {
    const float x = p[0] - centre_[0], y = p[1] - centre_[1], z = p[2] - centre_[2];
    const float away = std::fmax(std::fabs(x), std::fmax(std::fabs(y), std::fabs(z)));
    for (const Level& level : levels_) {
      if (away < level.half) {
        const int i = static_cast<int>((x + level.half) * level.per_metre),
                  j = static_cast<int>((y + level.half) * level.per_metre),
                  k = static_cast<int>((z + level.half) * level.per_metre);
        return level.begin + (k * level.side + j) * level.side + i;
      }
    }
    return -1;
  }
  /// The same of `count` points, as structure of arrays; rounding may put points on the border of two cells into the other one.
  void cells(const float* x, const float* y, const float* z, int count, int* cells) const noexcept;
  int num_cells() const noexcept { return num_cells_; }
  /// Level of a cell, and the edge of its cells [m].
  int level(int cell) const noexcept { return cell >= levels_[2].begin ? 2 : cell >= levels_[1].begin ? 1 : 0; }
  double edge(int level) const noexcept { return edges_[static_cast<std::size_t>(level)]; }

 private:
  struct Level {
    float half, per_metre;
    int side, begin;
  };
  std::array<float, 3> centre_;
  std::array<Level, num_levels> levels_;
  std::array<double, num_levels> edges_;
  int num_cells_ = 0;
};

}  // namespace sidestep
