#pragma once

#include <Eigen/Core>
#include <vector>

#include "cell_table.hpp"

namespace sidestep {

/// Where points rested, set after set: cells of space with the time since when.
class RestMemory {
 public:
  static constexpr double reach = 0.012;  ///< Distance from a cell within which a point is taken for one of it [m]: noise.

  struct Rest {
    double age = 0.0;  ///< [s] since when something rests here
    int sets = 0;      ///< in how many sets; 0: nothing does
  };

  /// A set begins, at `time` [s], of at most `num_points`. What was not seen for `memory` [s] is forgotten.
  void begin(double time, double memory, std::size_t num_points);

  /// What rested longest, and in most sets, within `reach` of a place before this set.
  Rest at(const Eigen::Vector3d& place) const noexcept;

  /// A point of this set rests there; `certain`: earlier sets show it. Else it counts only where nothing rested before.
  void rests(const Eigen::Vector3d& place, bool certain);
  /// One moves there: unless others rest in its cell, nothing does. After all calls of `rests`.
  void moves(const Eigen::Vector3d& place) noexcept;

  void forget();

 private:
  struct Entry {
    Cell cell;
    double since, last;  // [s]
    int sets;
  };

  static constexpr double edge = 0.02;  // Edge of a cell [m].

  CellTable table_;
  std::vector<Entry> entries_;
  double time_ = 0.0;
};

}  // namespace sidestep
