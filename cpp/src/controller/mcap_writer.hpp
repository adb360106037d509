#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <span>
#include <string_view>

namespace sidestep::recording {

// The numbers of MCAP (mcap.dev/spec) that Sidestep writes and reads.
constexpr std::string_view mcap_magic{"\x89MCAP0\r\n", 8};
enum class McapRecord : std::uint8_t { header = 1, footer = 2, schema = 3, channel = 4, message = 5, chunk = 6, data_end = 15 };

/// An MCAP file that is written record by record, without chunks and index: after `flush` it can be read, however the program ends.
class McapWriter {
 public:
  using Part = std::span<const std::byte>;

  /// Replaces a file; `exclusive`: there must be none. Throws std::system_error.
  McapWriter(const std::filesystem::path& path, std::string_view library, bool exclusive);
  ~McapWriter() { close(); }
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// id: from 1.
  void schema(std::uint16_t id, std::string_view name, std::string_view encoding, std::string_view text);
  /// schema: 0: none.
  void channel(std::uint16_t id, std::uint16_t schema, std::string_view topic, std::string_view encoding);
  /// time: [ns]. The message is `content`, then `tail`.
  void message(std::uint16_t channel, std::uint64_t time, Part content, Part tail = {});
  void flush() noexcept;
  /// Ends the file; again does nothing.
  void close() noexcept;

  std::uint64_t bytes() const noexcept { return bytes_; }
  /// errno of the first failure; 0: none. From then on nothing is written.
  int error() const noexcept { return error_; }

 private:
  void record(McapRecord kind, std::initializer_list<Part> parts);
  void write(Part bytes) noexcept;

  std::FILE* file_ = nullptr;
  int error_ = 0;
  std::uint64_t bytes_ = 0;
  std::map<std::uint16_t, std::uint32_t> sequences_;  // Number of messages of each channel.
};

}  // namespace sidestep::recording
