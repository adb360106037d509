#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace sidestep {

/// A cube of space: how many edges it lies from the origin along each axis.
using Cell = std::array<int, 3>;

/// The cell of a place among cells of that edge [m]; places beyond a million edges share cells.
inline Cell cell_at(const Eigen::Vector3d& place, double edge) noexcept {
  constexpr double most = 1e6;
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[static_cast<std::size_t>(axis)] = static_cast<int>(std::clamp(std::floor(place[axis] / edge), -most, most));
  }
  return cell;
}

/// Hash table from cells to the numbers 0, 1, … in the order in which they were added.
class CellTable {
 public:
  /// Empty, with space for a number of cells.
  void reset(std::size_t num_cells) {
    slots_.assign(std::bit_ceil(2 * num_cells + 2), Slot{0, -1});
    num_ = 0;
  }

  int size() const noexcept { return num_; }

  /// Number of a cell; -1: not in the table.
  int find(const Cell& cell) const noexcept { return slots_.empty() ? -1 : slots_[slot(key(cell))].number; }

  /// The same; adds the cell if it is not in the table. Not more cells than there is space for.
  int add(const Cell& cell) noexcept {
    Slot& found = slots_[slot(key(cell))];
    if (found.number < 0) {
      found = {key(cell), num_++};
    }
    return found.number;
  }

 private:
  struct Slot {
    std::uint64_t key;
    int number;
  };

  static std::uint64_t key(const Cell& cell) noexcept {
    constexpr int offset = 1 << 20;
    const auto bits = [](int i) { return static_cast<std::uint64_t>(i + offset); };
    return bits(cell[0]) << 42 | bits(cell[1]) << 21 | bits(cell[2]);
  }

  std::size_t slot(std::uint64_t key) const noexcept {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = static_cast<std::size_t>((key * 0x9e3779b97f4a7c15ull) >> 32) & mask;
    while (slots_[at].number >= 0 && slots_[at].key != key) {
      at = (at + 1) & mask;
    }
    return at;
  }

  std::vector<Slot> slots_;
  int num_ = 0;
};

}  // namespace sidestep
