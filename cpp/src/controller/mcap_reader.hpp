#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mcap_writer.hpp"

namespace sidestep::recording {

/// The messages of an MCAP file without chunks, one after the other. A file that was cut off is read up to its last whole record.
class McapReader {
 public:
  /// Throws std::system_error, std::invalid_argument where it is no such file.
  explicit McapReader(const std::filesystem::path& path);

  /// Whether there is a next message, which the members below then are. Throws std::invalid_argument where a record is none of MCAP's,
  /// or a chunk.
  bool next();

  std::uint64_t time = 0;              ///< [ns]
  std::string topic, encoding;         ///< of its channel
  std::span<const std::byte> content;  ///< valid until the next one
  std::uint64_t begin = 0;             ///< of its record in the file [B]

 private:
  struct Channel {
    std::string topic, encoding;
  };
  bool next_record();

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, at_ = 0;
  McapRecord kind_ = McapRecord::header;
  std::vector<std::byte> record_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace sidestep::recording
