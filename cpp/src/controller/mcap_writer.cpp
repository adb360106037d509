#include "mcap_writer.hpp"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "recording_bytes.hpp"

namespace sidestep::recording {
namespace {

constexpr std::size_t mcap_buffer = std::size_t{1} << 18;  // Size of the file's buffer [B].

std::span<const std::byte> bytes_of_text(std::string_view text) noexcept {
  return std::as_bytes(std::span<const char>(text.data(), text.size()));
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path, std::string_view library, bool exclusive) {
  errno = 0;
  file_ = std::fopen(path.string().c_str(), exclusive ? "wbx" : "wb");
  if (file_ == nullptr) {
    throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(),
                            "cannot write recording '" + path.string() + "'");
  }
  std::setvbuf(file_, nullptr, _IOFBF, mcap_buffer);
  write(bytes_of_text(mcap_magic));
  Bytes content;
  Encoder<Bytes> out(content);
  out(std::string(), std::string(library));  // profile, library
  record(McapRecord::header, {content.bytes});
}

void McapWriter::schema(std::uint16_t id, std::string_view name, std::string_view encoding, std::string_view text) {
  Bytes content;
  Encoder<Bytes> out(content);
  out(id, std::string(name), std::string(encoding), std::string(text));
  record(McapRecord::schema, {content.bytes});
}

void McapWriter::channel(std::uint16_t id, std::uint16_t schema, std::string_view topic, std::string_view encoding) {
  Bytes content;
  Encoder<Bytes> out(content);
  out(id, schema, std::string(topic), std::string(encoding), std::uint32_t{0});  // no metadata
  record(McapRecord::channel, {content.bytes});
}

void McapWriter::message(std::uint16_t channel, std::uint64_t time, Part content, Part tail) {
  Bytes head;
  Encoder<Bytes> out(head);
  out(channel, sequences_[channel]++, time, time);  // logged and published
  record(McapRecord::message, {head.bytes, content, tail});
}

void McapWriter::record(McapRecord kind, std::initializer_list<Part> parts) {
  std::uint64_t size = 0;
  for (const Part& part : parts) {
    size += part.size();
  }
  Bytes begin;
  Encoder<Bytes> frame(begin);
  frame(kind, size);
  write(begin.bytes);
  for (const Part& part : parts) {
    write(part);
  }
}

void McapWriter::write(Part bytes) noexcept {
  if (file_ == nullptr || error_ != 0 || bytes.empty()) {
    return;
  }
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) {
    error_ = errno != 0 ? errno : EIO;
    return;
  }
  bytes_ += bytes.size();
}

void McapWriter::flush() noexcept {
  errno = 0;
  if (file_ != nullptr && error_ == 0 && std::fflush(file_) != 0) {
    error_ = errno != 0 ? errno : EIO;
  }
}

void McapWriter::close() noexcept {
  if (file_ == nullptr) {
    return;
  }
  try {
    Bytes end, footer;
    Encoder<Bytes> data_end(end), last(footer);
    data_end(std::uint32_t{0});                                  // checksum of the data: none
    last(std::uint64_t{0}, std::uint64_t{0}, std::uint32_t{0});  // no summary
    record(McapRecord::data_end, {end.bytes});
    record(McapRecord::footer, {footer.bytes});
    write(bytes_of_text(mcap_magic));
  } catch (...) {  // out of memory
    error_ = error_ != 0 ? error_ : ENOMEM;
  }
  errno = 0;
  if (std::fclose(std::exchange(file_, nullptr)) != 0 && error_ == 0) {
    error_ = errno != 0 ? errno : EIO;
  }
}

}  // namespace sidestep::recording
