#include "arm_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

#include "arm_sections.hpp"
#include "sha256.hpp"

// The file, little endian: magic (8 bytes), version (u32), size of the payload (u64), SHA-256 of the payload (32
// bytes), payload. The payload is a row of sections in a fixed order: tag (4 bytes), size (u64), content. A text is its
// size (u32) and UTF-8; a list is its length (u32) and its entries; numbers are IEEE doubles, matrices by columns.
namespace sidestep {
namespace {

// First bytes of every file: not text, and a transfer that changes line ends breaks them.
constexpr std::string_view magic{"\x89SSARM\r\n", 8};
constexpr std::uint32_t version = 2;  // Version of the format that is written.
// Oldest version that is read: without jerk limits and rates of effort, which get their defaults.
constexpr std::uint32_t oldest_version = 1;
constexpr std::size_t header_size = 8 + 4 + 8 + 32;  // Size of the header [B]: magic, version, payload size, hash.
// Largest file that is read [B]: an arm has less than a thousandth of it.
constexpr std::uintmax_t largest_file = std::uintmax_t{1} << 30;

[[noreturn]] void throw_system_error(const std::string& what, const std::filesystem::path& path) {
  throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), what + " '" + path.string() + "'");
}

/// A file that is removed again unless it is moved to its place.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : path_(target) {
    path_ += ".part-" + std::to_string(std::random_device{}());
    errno = 0;
    file_ = std::fopen(path_.string().c_str(), "wbx");
    if (file_ == nullptr) {
      throw_system_error("cannot write arm file", target);
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (file_ != nullptr) {
      std::fclose(file_);
    }
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  /// Writes everything through to the disk.
  bool write(std::span<const std::byte> bytes) {
    bool written = std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size() && std::fflush(file_) == 0;
#if defined(__unix__) || defined(__APPLE__)
    written = written && fsync(fileno(file_)) == 0;
#endif
    const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
    return written && closed;
  }
  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  std::FILE* file_ = nullptr;
};

}  // namespace

std::vector<std::byte> encode_content(const ArmParts& parts) {
  ArmWriter out;
  write_content(out, parts);
  return out.take();
}

std::vector<std::byte> encode_arm(const ArmParts& parts) {
  ArmWriter payload;
  write_content(payload, parts);
  write_provenance(payload, parts.details.provenance);
  const std::vector<std::byte> bytes = payload.take();
  ArmWriter file;
  file.raw(magic);
  file.integer(version);
  file.integer(static_cast<std::uint64_t>(bytes.size()));
  file.raw(sha256(bytes));
  file.raw(bytes);
  return file.take();
}

Arm decode_arm(std::span<const std::byte> file) {
  ArmReader header(file.first(std::min(file.size(), header_size)));
  const bool starts_well =
      file.size() >= magic.size() &&
      std::equal(magic.begin(), magic.end(), file.begin(), [](char c, std::byte b) { return static_cast<std::byte>(c) == b; });
  if (!starts_well) {
    throw std::invalid_argument(std::string("it is not an arm file") + arm_file_advice);
  }
  header.raw(magic.size());
  const auto found = header.integer<std::uint32_t>();
  if (found < oldest_version || found > version) {
    throw std::invalid_argument(
        "it has format version " + std::to_string(found) + ", this Sidestep reads versions " + std::to_string(oldest_version) +
        " to " + std::to_string(version) +
        (found > version ? "; install a newer Sidestep, or prepare the arm again with this one" : arm_file_advice));
  }
  const auto size = header.integer<std::uint64_t>();
  const auto hash = header.raw(32);
  const auto payload = file.subspan(header_size);
  if (size != payload.size()) {
    throw std::invalid_argument("it holds " + std::to_string(payload.size()) + " bytes of content where " +
                                std::to_string(size) + " must be: it was cut off or changed" + arm_file_advice);
  }
  if (const Sha256 of_content = sha256(payload); !std::equal(of_content.begin(), of_content.end(), hash.begin())) {
    throw std::invalid_argument(std::string("its content does not have the hash that it states: it is damaged") +
                                arm_file_advice);
  }
  ArmReader in(payload);
  return read_sections(in, found);
}

Arm Arm::load(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  std::error_code failed;
  const std::uintmax_t size = stream ? std::filesystem::file_size(path, failed) : 0;
  if (!stream || failed) {
    if (failed) {
      errno = failed.value();
    }
    throw_system_error("cannot read arm file", path);
  }
  try {
    if (size > largest_file) {
      throw std::invalid_argument("it has " + std::to_string(size) + " bytes, too many for an arm" + arm_file_advice);
    }
    std::vector<char> text(static_cast<std::size_t>(size));
    if (!stream.read(text.data(), static_cast<std::streamsize>(text.size()))) {
      throw_system_error("cannot read arm file", path);
    }
    return decode_arm(std::as_bytes(std::span<const char>(text)));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("arm file '" + path.string() + "': " + error.what());
  }
}

std::vector<std::byte> Arm::bytes() const {
  const Content& content = *content_;
  return encode_arm({content.robot, content.body, content.pairs, content.tables, content.inertials, content.details});
}

Arm Arm::from_bytes(std::span<const std::byte> bytes) { return decode_arm(bytes); }

void Arm::save(const std::filesystem::path& path) const {
  TemporaryFile temporary(path);
  errno = 0;
  if (!temporary.write(bytes())) {
    throw_system_error("cannot write arm file", path);
  }
  std::error_code failed;
  std::filesystem::rename(temporary.path(), path, failed);
  if (failed) {
    throw std::system_error(failed, "cannot write arm file '" + path.string() + "'");
  }
}

}  // namespace sidestep
