#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <system_error>

namespace sidestep::recording {

/// Throws std::system_error that names the file.
[[noreturn]] inline void refuse_recording(int number, const std::filesystem::path& path) {
  throw std::system_error(number != 0 ? number : EIO, std::generic_category(), "cannot read recording '" + path.string() + "'");
}

inline std::ifstream open_recording(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    refuse_recording(errno, path);
  }
  return stream;
}

inline std::uint64_t size_of_recording(const std::filesystem::path& path) {
  std::error_code failed;
  const std::uint64_t size = std::filesystem::file_size(path, failed);
  if (failed) {
    refuse_recording(failed.value(), path);
  }
  return size;
}

/// Fills all of `bytes`.
inline void read_recording(std::ifstream& stream, std::span<std::byte> bytes, const std::filesystem::path& path) {
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
    refuse_recording(EIO, path);
  }
}

}  // namespace sidestep::recording
