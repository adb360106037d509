#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string_view>
#include <vector>

namespace sidestep::recording {

constexpr std::string_view step_file_magic{"\x89SSTEP\r\n", 8};

/// The chunks of a recording of Sidestep 0.2 (`.step`), one after the other: each a tag (4 bytes), the size of its content (u64), the
/// content and the CRC-32 of all that (u32).
class StepFileReader {
 public:
  static constexpr std::size_t tag_size = 4;

  /// Throws std::system_error.
  explicit StepFileReader(const std::filesystem::path& path);

  /// Whether there is a next whole chunk, which the members below then are.
  bool next();

  std::string_view tag;
  std::span<const std::byte> content;
  std::uint64_t begin = 0;  ///< of the chunk in the file [B]
  bool damaged = false;     ///< the chunk at `begin` is not what was written

 private:
  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, at_ = 0;
  std::vector<std::byte> whole_;
};

}  // namespace sidestep::recording
