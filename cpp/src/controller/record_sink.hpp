#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "recording_content.hpp"
#include "set_history.hpp"

namespace sidestep {

/// Where the thread of a recorder writes, and nobody else.
class RecordSink {
 public:
  RecordSink() = default;
  RecordSink(const RecordSink&) = delete;
  RecordSink& operator=(const RecordSink&) = delete;
  virtual ~RecordSink() = default;

  /// Any record but a set of obstacles. time: of the step, or of the last before it [s].
  virtual void write(recording::RecordKind kind, double time, std::span<const std::byte> content) = 0;
  virtual void write_set(double time, const RecordedSet& set) = 0;
  /// What was written can be read from now on.
  virtual void flush() = 0;
  virtual void close() = 0;
  /// errno of the first failure; 0: none. From then on nothing is written.
  virtual int error() const noexcept = 0;
  /// What was written, and is still there.
  virtual std::vector<std::filesystem::path> files() const = 0;
  virtual std::uint64_t bytes() const noexcept = 0;
};

}  // namespace sidestep
