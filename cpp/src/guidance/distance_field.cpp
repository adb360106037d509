#include "sidestep/guidance/distance_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/distance_kernel.hpp"

namespace sidestep {
namespace {

constexpr float unknown = -std::numeric_limits<float>::infinity();
constexpr double rounding = 1e-6;  // of distances in single precision, relative and, for cells' places, absolute [m]
constexpr int offset = 1 << 20;    // of blocks, so that their numbers are positive
constexpr double farthest = 1e5;   // [m] that a place may be away to have a block

/// Below and above a distance that was rounded.
double below(double distance) noexcept { return distance - rounding * (std::abs(distance) + 1.0); }
double above(double distance) noexcept { return distance + rounding * (std::abs(distance) + 1.0); }

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
  double best = -std::numeric_limits<double>::infinity(), coarser = PointTree::padding;
  Eigen::Vector3d coarser_centre = Eigen::Vector3d::Zero();
  for (const int cells : levels) {
    const double cell = block_edge / cells, per_length = cells / block_edge;
    int at = 0;
    Eigen::Vector3d centre;
    for (int i = 0; i < 3; ++i) {
      const int number = std::clamp(static_cast<int>(inside[i] * per_length), 0, cells - 1);
      at = at * cells + number;
      centre[i] = (number + 0.5) * cell;
    }
    if (known[at] == unknown) {
      const double limit = above(coarser + (centre - coarser_centre).norm());
      known[at] = static_cast<float>(distance_to_obstacles(corner + centre, obstacles, limit));
    }
    best = std::max(best, below(known[at]) - (inside - centre).norm());
    if (best >= enough) {
      break;
    }
    coarser = known[at];
    coarser_centre = centre;
    known += cells * cells * cells;
  }
  return best;
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
