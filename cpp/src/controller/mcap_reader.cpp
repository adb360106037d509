#include "mcap_reader.hpp"

#include <stdexcept>

#include "recording_bytes.hpp"
#include "recording_stream.hpp"

namespace sidestep::recording {

McapReader::McapReader(const std::filesystem::path& path) : path_(path), stream_(open_recording(path)) {
  size_ = size_of_recording(path);
  std::string begin_of_file(mcap_magic.size(), '\0');
  if (!stream_.read(begin_of_file.data(), static_cast<std::streamsize>(begin_of_file.size())) || begin_of_file != mcap_magic) {
    throw std::invalid_argument("recording '" + path.string() + "': it is not a recording of a controller's steps");
  }
  at_ = mcap_magic.size();
}

bool McapReader::next() {
  while (next_record()) {
    Decoder in(record_);
    switch (kind_) {
      case McapRecord::channel: {
        const auto id = in.take<std::uint16_t>();
        in.take<std::uint16_t>();  // schema
        Channel& channel = channels_[id];
        in(channel.topic, channel.encoding);
        break;
      }
      case McapRecord::message: {
        const auto id = in.take<std::uint16_t>();
        in.take<std::uint32_t>();  // sequence
        time = in.take<std::uint64_t>();
        in.take<std::uint64_t>();  // published
        const auto channel = channels_.find(id);
        if (channel == channels_.end()) {
          throw std::invalid_argument("a message is of channel " + std::to_string(id) + ", which was not announced");
        }
        topic = channel->second.topic;
        encoding = channel->second.encoding;
        content = in.rest();
        return true;
      }
      case McapRecord::chunk:
        throw std::invalid_argument("it has chunks, as other programs write them; only files as Sidestep writes them are read");
      case McapRecord::data_end:
      case McapRecord::footer: return false;
      default: break;  // others are to be passed over
    }
  }
  return false;
}

bool McapReader::next_record() {
  constexpr std::uint64_t frame = 1 + sizeof(std::uint64_t);
  begin = at_;
  if (size_ - at_ < frame) {
    return false;
  }
  record_.resize(frame);
  read_recording(stream_, record_, path_);
  Decoder in(record_);
  kind_ = in.take<McapRecord>();
  const auto length = in.take<std::uint64_t>();
  if (length > size_ - at_ - frame) {
    return false;
  }
  record_.resize(static_cast<std::size_t>(length));
  read_recording(stream_, record_, path_);
  at_ += frame + length;
  return true;
}

}  // namespace sidestep::recording
