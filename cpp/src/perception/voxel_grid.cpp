#include "sidestep/perception/voxel_grid.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "../math/kernels/in_use.hpp"
#include "kernels/image_kernel.hpp"

namespace sidestep {
namespace {

constexpr double most_cells = 2e8;  // Cells of all levels, at most: 800 MB.

}  // namespace

VoxelGrid::VoxelGrid(const Eigen::Vector3d& centre, double fine, double far, double voxel)
    : centre_{static_cast<float>(centre.x()), static_cast<float>(centre.y()), static_cast<float>(centre.z())} {
  const std::array<double, num_levels> halves{fine, 0.5 * (fine + far), far};
  double cells = 0.0;
  for (std::size_t n = 0; n < levels_.size(); ++n) {
    edges_[n] = voxel * scales[n];
    const double side = std::ceil(2.0 * halves[n] / edges_[n]) + 1.0;
    cells += side * side * side;
    if (cells > most_cells) {
      throw std::invalid_argument(
          "perception: a voxel of " + std::to_string(voxel) + " m within " + std::to_string(far) +
          " m of the arm's base would take more than 2e8 cells, allowed: larger voxels or smaller margins");
    }
    levels_[n] = {static_cast<float>(halves[n]), static_cast<float>(1.0 / edges_[n]), static_cast<int>(side), num_cells_};
    num_cells_ = static_cast<int>(cells);
  }
}

void VoxelGrid::cells(const float* x, const float* y, const float* z, int count, int* cells) const noexcept {
  const kernels::ImageKernel kernel = SIDESTEP_KERNEL_IN_USE(kernels::image_kernel)();
  std::fill(cells, cells + count, -1);
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {  // finer levels overwrite coarser ones
    kernel.cells({{centre_[0], centre_[1], centre_[2]}, level->half, level->per_metre, level->side, level->begin}, x, y, z,
                 count, cells);
  }
}

}  // namespace sidestep
