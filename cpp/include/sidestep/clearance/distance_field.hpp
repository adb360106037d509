#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Cache of distances to the nearest obstacle ball, on grids that are filled on demand.
///
/// A cell keeps the distance d of its centre c. As a distance changes no faster than the place,
///
///     distance(x) ≥ d(c) − |x − c|,
///
/// which costs one look-up after an earlier query near x. Coarse cells serve far obstacles, fine ones near obstacles. Blocks
/// are hashed by their place, so that no workspace has to be stated. One per thread.
class DistanceField {
 public:
  DistanceField();

  /// Selects the obstacles; keeps the cache if they are the same, see Obstacles::version().
  void follow(const Obstacles& obstacles) noexcept;

  /// Lower bound of the distance of x [m] from the obstacles of `follow`, which must not have changed. It is at least `enough`,
  /// or the best that the cells give: lower than the distance by at most the diagonal of a fine cell, 7 cm.
  double bound(const Eigen::Vector3d& x, double enough, const Obstacles& obstacles) noexcept;

 private:
  static constexpr double block_edge = 0.16;               // Edge of a block [m].
  static constexpr int divisions = 4;                      // Fine cells along the edge of a block.
  static constexpr int most_blocks = 4096;                 // Most blocks; places outside them are measured each time.
  static constexpr std::uint32_t slots = 2 * most_blocks;  // Slots of the hash table.
  // Distance at the coarse cell, which is the block, and at the fine ones.
  using Block = std::array<float, 1 + divisions * divisions * divisions>;
  struct Slot {
    std::uint64_t key = 0;
    std::uint64_t generation = 0;  // Generation of the obstacles; slots of another one are empty.
    int block = 0;
  };

  float* block_of(std::uint64_t key) noexcept;

  std::vector<Slot> slots_;
  Slot last_;  // Slot of the last query: successive places are often near each other.
  std::vector<Block> blocks_;
  int used_ = 0;
  std::uint64_t generation_ = 1;
  std::uint64_t version_ = 0;
};

/// The distance of x from the nearest ball [m], not above `limit`.
double distance_to_obstacles(const Eigen::Vector3d& x, const Obstacles& obstacles, double limit) noexcept;

}  // namespace sidestep
