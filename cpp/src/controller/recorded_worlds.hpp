#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>

#include "recording_content.hpp"
#include "set_history.hpp"
#include "world.hpp"

namespace sidestep {

/// The obstacles of a recording, from when they were set until a step takes newer ones.
class RecordedWorlds {
 public:
  /// What follows is of a file of this format version.
  void begin_file(std::uint32_t format);
  /// Records of the kinds `obstacles` and `world`.
  void keep_set(std::span<const std::byte> content);
  void keep_world(std::span<const std::byte> content);
  /// The obstacles of that number; forgets those before them. Throws std::invalid_argument where they are missing.
  World take(std::uint64_t number);

 private:
  std::uint32_t format_ = recording::format;
  SetHistory history_;
  std::map<std::uint64_t, std::shared_ptr<const Obstacles>> sets_;
  std::map<std::uint64_t, recording::WorldRecord> worlds_;
};

}  // namespace sidestep
