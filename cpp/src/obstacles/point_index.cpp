#include "sidestep/obstacles/point_index.hpp"

#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

// Edge by default: smaller ones cost more rows per query, larger ones more points per row [m].
constexpr double finest_cell = 0.04;
constexpr double points_per_cell = 0.25;  // on average over the box; surfaces fill few cells of it

}  // namespace

PointIndex::PointIndex(const Obstacles& obstacles, double cell) {
  if (!(cell >= 0.0) || !std::isfinite(cell)) {
    throw std::invalid_argument("point index: cell is " + std::to_string(cell) + " m, must be finite and >= 0");
  }
  const Eigen::Index num = obstacles.size();
  if (num == 0) {
    return;
  }
  const Eigen::Matrix3Xd& points = obstacles.points();
  largest_radius_ = obstacles.radii().maxCoeff();
  origin_ = points.rowwise().minCoeff();
  const Eigen::Vector3d extent = points.rowwise().maxCoeff() - origin_;
  if (cell == 0.0) {
    const double volume = (extent.array() + finest_cell).prod();
    // Cells as large as the balls keep the number of rows of a query bounded.
    cell = std::max({finest_cell, std::cbrt(volume * points_per_cell / static_cast<double>(num)), largest_radius_});
  }
  const auto count = [&](double edge) { return (extent / edge).array().floor() + 1.0; };
  while (count(cell).prod() > max_cells) {
    cell *= 1.26;  // 2^(1/3): half the cells
  }
  cell_ = cell;
  per_cell_ = 1.0 / cell;
  const Eigen::Array3d cells = count(cell);
  for (int i = 0; i < 3; ++i) {
    cells_[static_cast<std::size_t>(i)] = static_cast<int>(cells[i]);
  }

  // Counting sort by cell.
  const auto cell_of = [&](Eigen::Index k) {
    std::array<int, 3> at;
    for (int i = 0; i < 3; ++i) {
      const auto j = static_cast<std::size_t>(i);
      at[j] = std::min(static_cast<int>((points(i, k) - origin_[i]) * per_cell_), cells_[j] - 1);
    }
    return static_cast<std::size_t>((at[2] * cells_[1] + at[1]) * cells_[0] + at[0]);
  };
  starts_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]) + 1, 0);
  std::vector<std::size_t> owners(static_cast<std::size_t>(num));
  for (Eigen::Index k = 0; k < num; ++k) {
    owners[static_cast<std::size_t>(k)] = cell_of(k);
    ++starts_[owners[static_cast<std::size_t>(k)] + 1];
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) {
    starts_[i] += starts_[i - 1];
  }
  std::vector<std::int32_t> next(starts_.begin(), starts_.end() - 1);
  const auto size = static_cast<std::size_t>(num);
  x_.resize(size), y_.resize(size), z_.resize(size), radius_.resize(size), order_.resize(size);
  for (Eigen::Index k = 0; k < num; ++k) {
    const auto at = static_cast<std::size_t>(next[owners[static_cast<std::size_t>(k)]]++);
    x_[at] = points(0, k), y_[at] = points(1, k), z_[at] = points(2, k);
    radius_[at] = obstacles.radii()[k];
    order_[at] = static_cast<int>(k);
  }
}

}  // namespace sidestep
