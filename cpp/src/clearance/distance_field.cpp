#include "sidestep/clearance/distance_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/distance_kernel.hpp"

namespace sidestep {
namespace {

constexpr float unknown = -std::numeric_limits<float>::infinity();  // Value of a cell that is not measured yet.
constexpr double rounding = 1e-6;  // Error of distances in single precision: relative and, for cells' places, absolute [m].
constexpr int offset = 1 << 20;    // Offset of block numbers, so that they are positive.
constexpr double farthest = 1e5;   // Largest coordinate of a place with a block [m].

/// Below and above a distance that was rounded.
double below(double distance) noexcept { return distance - rounding * (std::abs(distance) + 1.0); }
double above(double distance) noexcept { return distance + rounding * (std::abs(distance) + 1.0); }

/// One of the cells that a block is divided into, `count` along each edge.
struct Cell {
  int number;
  Eigen::Vector3d centre;  // Centre, from the corner of the block [m].
};

template <int count>
Cell cell(const Eigen::Vector3d& inside, double block_edge) noexcept {
  Cell found{0, {}};
  for (int i = 0; i < 3; ++i) {
    const int along = std::clamp(static_cast<int>(inside[i] * (count / block_edge)), 0, count - 1);
    found.number = found.number * count + along;
    found.centre[i] = (along + 0.5) * (block_edge / count);
  }
  return found;
}

}  // namespace

double distance_to_obstacles(const Eigen::Vector3d& x, const Obstacles& obstacles, double limit) noexcept {
  const kernels::Distances distances = kernels::distances();
  kernels::PlacedEllipsoid point{};
  Eigen::Map<Eigen::Vector3d>(point.centre) = x;
  for (const int i : {0, 4, 8}) {
    point.axes[i] = 1.0;
  }
  const auto measure = [&](const auto& nodes, int first, int count, double least, float* values) {
    return distances(point, nodes, first, count, least, values);
  };
  return obstacles.tree().nearest(limit, -std::numeric_limits<double>::infinity(), measure).distance;
}

DistanceField::DistanceField() : slots_(slots), blocks_(most_blocks) {}

void DistanceField::follow(const Obstacles& obstacles) noexcept {
  if (obstacles.version() != version_) {
    version_ = obstacles.version();
    ++generation_;
    used_ = 0;
  }
}

double DistanceField::bound(const Eigen::Vector3d& x, double enough, const Obstacles& obstacles) noexcept {
  float* known = nullptr;
  Eigen::Vector3d corner;
  if ((x.array().abs() < farthest).all()) {
    std::uint64_t key = 0;
    for (int i = 0; i < 3; ++i) {
      const int block = static_cast<int>(x[i] * (1.0 / block_edge) + offset);  // positive, so that it is rounded down
      corner[i] = (block - offset) * block_edge;
      key = key << 21 | static_cast<std::uint64_t>(block);
    }
    known = block_of(key);
  }
  if (known == nullptr) {
    return below(distance_to_obstacles(x, obstacles, PointTree::padding));
  }
  const Eigen::Vector3d inside = x - corner;
  const Cell coarse = cell<1>(inside, block_edge), fine = cell<divisions>(inside, block_edge);
  float &at_coarse = known[0], &at_fine = known[1 + fine.number];
  if (at_coarse == unknown) {
    at_coarse = static_cast<float>(distance_to_obstacles(corner + coarse.centre, obstacles, PointTree::padding));
  }
  // At least `enough`, which a square tells too, or else what the fine cell says.
  const double spare = below(at_coarse) - enough;
  if (spare >= 0.0 && (inside - coarse.centre).squaredNorm() <= spare * spare) {
    return enough;
  }
  if (at_fine == unknown) {
    const double limit = above(at_coarse + (fine.centre - coarse.centre).norm());
    at_fine = static_cast<float>(distance_to_obstacles(corner + fine.centre, obstacles, limit));
  }
  return below(at_fine) - (inside - fine.centre).norm();
}

float* DistanceField::block_of(std::uint64_t key) noexcept {
  if (key == last_.key && last_.generation == generation_) {
    return blocks_[static_cast<std::size_t>(last_.block)].data();
  }
  for (std::uint64_t at = key * 0x9E3779B97F4A7C15u >> 40;; ++at) {
    Slot& slot = slots_[at % slots];
    if (slot.generation != generation_) {
      if (used_ == most_blocks) {
        return nullptr;
      }
      slot = {key, generation_, used_++};
      blocks_[static_cast<std::size_t>(slot.block)].fill(unknown);
    }
    if (slot.key == key) {
      last_ = slot;
      return blocks_[static_cast<std::size_t>(slot.block)].data();
    }
  }
}

}  // namespace sidestep
