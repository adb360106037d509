#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "mcap_writer.hpp"
#include "record_sink.hpp"

namespace sidestep {

/// One MCAP file with a channel for each kind of record, and one of JSON, at most 50 times a second, that other programs read.
class RecordingFile final : public RecordSink {
 public:
  /// Replaces a file; `exclusive`: there must be none. Throws std::system_error.
  RecordingFile(const std::filesystem::path& path, int num_coordinates, bool exclusive = false);

  void write(recording::RecordKind kind, double time, std::span<const std::byte> content) override;
  void write_set(double time, const RecordedSet& set) override;
  void flush() override { file_.flush(); }
  void close() override { file_.close(); }
  int error() const noexcept override { return file_.error(); }
  std::vector<std::filesystem::path> files() const override { return {path_}; }
  std::uint64_t bytes() const noexcept override { return file_.bytes(); }

 private:
  void write_summary(double time, std::span<const std::byte> step);

  const std::filesystem::path path_;
  recording::McapWriter file_;
  SetHistory sets_;
  recording::Bytes set_bytes_;
  const recording::CommandReader commands_;
  double summarized_ = -std::numeric_limits<double>::infinity();  // Time of the last summary [s].
  recording::StepInputs step_;
  Command command_;
  std::string text_;
};

}  // namespace sidestep
