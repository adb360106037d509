#include "rest_memory.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {

void RestMemory::begin(double time, double memory, std::size_t num_points) {
  time_ = time;
  std::erase_if(entries_, [&](const Entry& entry) { return entry.sets == 0 || time - entry.last > memory; });
  table_.reset(entries_.size() + num_points);
  for (const Entry& entry : entries_) {
    table_.add(entry.cell);
  }
}

RestMemory::Rest RestMemory::at(const Eigen::Vector3d& place) const noexcept {
  const Cell low = cell_at(place.array() - reach, edge), high = cell_at(place.array() + reach, edge);
  Rest longest;
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const int k = table_.find({x, y, z});
        if (k < 0) {
          continue;
        }
        const Entry& entry = entries_[static_cast<std::size_t>(k)];
        if (entry.sets > 0) {
          longest.age = std::max(longest.age, time_ - entry.since);
          longest.sets = std::max(longest.sets, entry.sets);
        }
      }
    }
  }
  return longest;
}

void RestMemory::rests(const Eigen::Vector3d& place, bool certain) {
  const Cell cell = cell_at(place, edge);
  const auto k = static_cast<std::size_t>(table_.add(cell));
  if (k == entries_.size()) {
    entries_.push_back({cell, time_, time_, 1});
  } else if (Entry& entry = entries_[k]; entry.sets == 0) {
    entry = {cell, time_, time_, 1};
  } else if (certain && entry.last < time_) {
    entry.last = time_;
    ++entry.sets;
  }
}

void RestMemory::moves(const Eigen::Vector3d& place) noexcept {
  const int k = table_.find(cell_at(place, edge));
  if (k >= 0 && entries_[static_cast<std::size_t>(k)].last < time_) {
    entries_[static_cast<std::size_t>(k)].sets = 0;
  }
}

void RestMemory::forget() {
  entries_.clear();
  table_.reset(0);
}

}  // namespace sidestep
