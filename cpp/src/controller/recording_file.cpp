#include "recording_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sidestep {
namespace {

constexpr double summary_period = 0.02;  // Time between two summaries, at least [s].
constexpr double stamp_digits = 1e-6;    // Rounding of the differences of times [s].
constexpr double nanoseconds = 1e9;      // [1/s]
constexpr std::uint16_t summary_channel = recording::num_record_kinds + 1, summary_schema = 1;
constexpr std::string_view summary_text = R"({
  "type": "object",
  "title": "What a Sidestep controller did, at most 50 times a second",
  "properties": {
    "t": {"type": "number", "description": "time of the step [s]"},
    "status": {"type": "string", "description": "how safe the command is, see SafetyStatus"},
    "activity": {"type": "string", "description": "what the controller is doing, see Activity"},
    "clearance": {"type": ["number", "null"], "description": "least clearance of the covering body [m]; null: far or unknown"},
    "q": {"type": "array", "items": {"type": ["number", "null"]}, "description": "measured positions [rad | m]"},
    "v": {"type": "array", "items": {"type": ["number", "null"]}, "description": "measured velocities [rad/s | m/s]"}
  }
})";

std::uint64_t to_nanoseconds(double seconds) noexcept {
  constexpr double most = 9e18;  // [ns]
  const double time = nanoseconds * seconds;
  return time > 0.0 ? static_cast<std::uint64_t>(std::min(time, most) + 0.5) : 0;  // NaN too
}

std::uint16_t channel_of(recording::RecordKind kind) noexcept { return static_cast<std::uint16_t>(1 + static_cast<int>(kind)); }

/// A number in JSON, which has none that is not finite.
void append_json(std::string& text, double value, int digits = 9) {
  char number[32];
  std::snprintf(number, sizeof number, "%.*g", digits, value);
  text += std::isfinite(value) ? number : "null";
}

void append_json(std::string& text, const Eigen::VectorXd& values) {
  text += '[';
  for (Eigen::Index j = 0; j < values.size(); ++j) {
    text += j > 0 ? "," : "";
    append_json(text, values[j]);
  }
  text += ']';
}

}  // namespace

RecordingFile::RecordingFile(const std::filesystem::path& path, int num_coordinates, bool exclusive)
    : path_(path),
      file_(path, std::string("sidestep ") + recording::sidestep_version(), exclusive),
      commands_(recording::fields_of_commands()),
      command_(num_coordinates) {
  for (std::size_t kind = 0; kind < recording::num_record_kinds; ++kind) {
    file_.channel(static_cast<std::uint16_t>(kind + 1), 0, recording::record_topics[kind], recording::record_encoding);
  }
  file_.schema(summary_schema, "sidestep.Summary", "jsonschema", summary_text);
  file_.channel(summary_channel, summary_schema, "/summary", "json");
}

void RecordingFile::write(recording::RecordKind kind, double time, std::span<const std::byte> content) {
  const std::uint32_t check = recording::little_endian(recording::crc32(content));
  file_.message(channel_of(kind), to_nanoseconds(time), content, std::as_bytes(std::span(&check, 1)));
  if (kind == recording::RecordKind::step && !(std::abs(time - summarized_) < summary_period - stamp_digits)) {
    summarized_ = time;
    write_summary(time, content);
  }
}

void RecordingFile::write_set(double time, const RecordedSet& set) {
  set_bytes_.bytes.clear();
  sets_.write(set, set_bytes_);
  write(recording::RecordKind::obstacles, time, set_bytes_.bytes);
}

void RecordingFile::write_summary(double time, std::span<const std::byte> step) {
  recording::Decoder in(step);
  recording::read_step_inputs(in, step_);
  commands_.read(recording::command_of(step), command_);
  text_ = "{\"t\":";
  append_json(text_, time, 15);  // also of clocks that began long ago
  text_ += std::string(",\"status\":\"") + to_string(command_.status) + "\",\"activity\":\"" + to_string(command_.activity) +
           "\",\"clearance\":";
  append_json(text_, command_.clearance);
  text_ += ",\"q\":";
  append_json(text_, step_.q);
  text_ += ",\"v\":";
  append_json(text_, step_.v);
  text_ += '}';
  file_.message(summary_channel, to_nanoseconds(time), std::as_bytes(std::span<const char>(text_)));
}

}  // namespace sidestep
