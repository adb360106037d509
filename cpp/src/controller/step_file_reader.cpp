#include "step_file_reader.hpp"

#include "recording_bytes.hpp"
#include "recording_stream.hpp"

namespace sidestep::recording {

StepFileReader::StepFileReader(const std::filesystem::path& path)
    : path_(path), stream_(open_recording(path)), size_(size_of_recording(path)), at_(step_file_magic.size()) {
  stream_.seekg(static_cast<std::streamoff>(at_));
}

bool StepFileReader::next() {
  constexpr std::uint64_t header = tag_size + sizeof(std::uint64_t), check = sizeof(std::uint32_t);
  begin = at_;
  if (size_ < at_ + header + check) {
    return false;
  }
  whole_.resize(header);
  read_recording(stream_, whole_, path_);
  Decoder in(std::span<const std::byte>(whole_).subspan(tag_size));
  const auto length = in.take<std::uint64_t>();
  if (length > size_ - at_ - header - check) {
    return false;
  }
  whole_.resize(static_cast<std::size_t>(header + length + check));
  read_recording(stream_, std::span(whole_).subspan(header), path_);
  at_ += whole_.size();
  const std::span<const std::byte> whole(whole_);
  Decoder end(whole.last(check));
  if (end.take<std::uint32_t>() != crc32(whole.first(whole.size() - check))) {
    damaged = true;
    return false;
  }
  tag = std::string_view(reinterpret_cast<const char*>(whole_.data()), tag_size);
  content = whole.subspan(header, static_cast<std::size_t>(length));
  return true;
}

}  // namespace sidestep::recording
