#include "recording_reader.hpp"

#include <algorithm>
#include <array>

#include "recording_stream.hpp"

namespace sidestep::recording {
namespace {

constexpr double nanosecond = 1e-9;  // [s]
constexpr std::array<std::string_view, num_record_kinds> step_file_tags{"HEAD", "ARMS", "WRLD", "REQU", "OBST", "STEP", "DONE"};

std::variant<McapReader, StepFileReader> open_either(const std::filesystem::path& path) {
  std::ifstream stream = open_recording(path);
  std::string magic(step_file_magic.size(), '\0');
  stream.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (magic == step_file_magic) {
    return StepFileReader(path);
  }
  return McapReader(path);
}

}  // namespace

RecordingReader::RecordingReader(const std::filesystem::path& file) : path(file), file_(open_either(file)) {
  const std::string what = "recording '" + path.string() + "': ";
  try {
    if (!next() || kind != RecordKind::head) {
      throw std::invalid_argument("its head is damaged or missing");
    }
    const auto version = Decoder(content).take<std::uint32_t>();
    const std::uint32_t known = std::holds_alternative<McapReader>(file_) ? format : step_file_format;
    if (version != known) {
      throw std::invalid_argument("it has format version " + std::to_string(version) + ", this Sidestep reads version " +
                                  std::to_string(known));
    }
    head = read_record<HeadRecord>(content);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(what + error.what());
  }
}

bool RecordingReader::next() {
  if (damaged_) {
    return false;
  }
  return std::visit(
      [this](auto& file) {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(file)>, McapReader>) {
          return next_message(file);
        } else {
          return next_chunk(file);
        }
      },
      file_);
}

bool RecordingReader::next_message(McapReader& file) {
  while (file.next()) {
    const auto name =
        std::find_if(record_topics.begin(), record_topics.end(), [&](std::string_view topic) { return topic == file.topic; });
    if (name == record_topics.end() || file.encoding != record_encoding) {
      continue;  // the summary, or what others added
    }
    constexpr std::size_t check = sizeof(std::uint32_t);
    const std::size_t size = file.content.size();
    if (size < check || Decoder(file.content.last(check)).take<std::uint32_t>() != crc32(file.content.first(size - check))) {
      damaged_ = true;
      return false;
    }
    kind = static_cast<RecordKind>(name - record_topics.begin());
    time = static_cast<double>(file.time) * nanosecond;
    content = file.content.first(size - check);
    return true;
  }
  return false;
}

bool RecordingReader::next_chunk(StepFileReader& file) {
  while (file.next()) {
    const auto tag = std::find(step_file_tags.begin(), step_file_tags.end(), file.tag);
    if (tag != step_file_tags.end()) {
      kind = static_cast<RecordKind>(tag - step_file_tags.begin());
      content = file.content;
      return true;
    }
  }
  damaged_ = file.damaged;
  return false;
}

std::string RecordingReader::damage() const {
  if (!damaged_) {
    return {};
  }
  const std::uint64_t begin = std::visit([](const auto& file) { return file.begin; }, file_);
  return "the bytes from " + std::to_string(begin) + " on";
}

RecordingHeader to_header(const HeadRecord& head) {
  RecordingHeader header{
      head.version, head.sidestep_version, head.compiler, head.instruction_set, head.whole, arm_of(head.arm_file), {}, {}};
  header.settings = to_settings(head.settings, header.notes);
  const std::vector<FieldRecord> now = fields_of_commands();
  const auto missing = [](const std::vector<FieldRecord>& in, const FieldRecord& field) {
    return std::none_of(in.begin(), in.end(),
                        [&](const auto& other) { return other.name == field.name && other.kind == field.kind; });
  };
  for (const auto& field : head.fields) {
    if (missing(now, field)) {
      header.notes.push_back("field " + field.name + " of a command is recorded, and there is none now: not compared");
    }
  }
  for (const auto& field : now) {
    if (missing(head.fields, field)) {
      header.notes.push_back("field " + field.name + " of a command is not in the recording: not compared");
    }
  }
  if (head.compiler != __VERSION__) {
    header.notes.push_back("compiler: recorded with " + head.compiler + ", now " + __VERSION__);
  }
  if (head.instruction_set != name(instruction_set())) {
    header.notes.push_back("instruction set: recorded with " + head.instruction_set + ", now " + name(instruction_set()));
  }
  if (head.sidestep_version != sidestep_version()) {
    header.notes.push_back("Sidestep: recorded with " + head.sidestep_version + ", now " + sidestep_version());
  }
  return header;
}

}  // namespace sidestep::recording
