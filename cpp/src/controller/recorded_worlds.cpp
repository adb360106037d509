#include "recorded_worlds.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "recording_reader.hpp"

namespace sidestep {

void RecordedWorlds::begin_file(std::uint32_t format) {
  format_ = format;
  history_ = {};  // each file stands alone
}

void RecordedWorlds::keep_set(std::span<const std::byte> content) {
  RecordedSet set = format_ > recording::step_file_format ? history_.read(content)
                                                          : to_set(recording::read_record<recording::ObstaclesRecord>(content));
  sets_.insert_or_assign(set.number, std::move(set.points));
}

void RecordedWorlds::keep_world(std::span<const std::byte> content) {
  auto record = recording::read_record<recording::WorldRecord>(content);
  const std::uint64_t number = record.number;
  worlds_.insert_or_assign(number, std::move(record));
}

World RecordedWorlds::take(std::uint64_t number) {
  const auto found = worlds_.find(number);
  if (found == worlds_.end()) {
    throw std::invalid_argument("its obstacles " + std::to_string(number) + " are missing");
  }
  World world;
  world.number = number;
  std::uint64_t oldest = number;
  for (const recording::SourceRecord& record : found->second.sources) {
    const auto points = sets_.find(record.number);
    if (points == sets_.end()) {
      throw std::invalid_argument("set " + std::to_string(record.number) + " of its source '" + record.name + "' is missing");
    }
    world.sources.push_back({record.name, record.id, record.number, record.time, record.heard, record.heard_number,
                             record.valid_for, record.moves_for, record.emptied, record.repeated, points->second});
    oldest = std::min(oldest, record.number);
  }
  world.obstacles = join(world.sources);
  worlds_.erase(worlds_.begin(), found);
  sets_.erase(sets_.begin(), sets_.lower_bound(oldest));
  return world;
}

}  // namespace sidestep
