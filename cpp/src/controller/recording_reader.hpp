#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>

#include "mcap_reader.hpp"
#include "recording_content.hpp"
#include "step_file_reader.hpp"

namespace sidestep::recording {

/// The records of a recording, one after the other.
class RecordingReader {
 public:
  /// Reads the head. Throws std::system_error if the file cannot be read, std::invalid_argument that says what is wrong with it.
  explicit RecordingReader(const std::filesystem::path& path);

  /// Whether there is a next whole record, which the members below then are. Throws std::invalid_argument.
  bool next();
  /// What is wrong where `next` found no more, as the end of a sentence; empty: nothing.
  std::string damage() const;

  const std::filesystem::path path;
  HeadRecord head;
  RecordKind kind = RecordKind::head;
  double time = 0.0;                   ///< of the step, or of the last before it [s]; 0 in a file of 0.2
  std::span<const std::byte> content;  ///< valid until the next one

 private:
  bool next_message(McapReader& file);
  bool next_chunk(StepFileReader& file);

  std::variant<McapReader, StepFileReader> file_;
  bool damaged_ = false;
};

/// Reads a record that has a `describe`.
template <class Record>
Record read_record(std::span<const std::byte> content) {
  Decoder in(content);
  Record record;
  describe(in, record);
  return record;
}

/// The same for the user, with notes on what this Sidestep does not know of the recording.
RecordingHeader to_header(const HeadRecord& head);

}  // namespace sidestep::recording
