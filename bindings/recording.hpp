#pragma once

#include <filesystem>
#include <optional>

#include "sidestep/controller/controller.hpp"

namespace sidestep::python {

/// A recording of a controller that outlives it.
struct RecordingInProgress {
  Controller* controller;
  std::filesystem::path path;
  std::optional<RecordingSummary> summary;  // Summary, once the recording has ended.

  RecordingSummary stop();
};

}  // namespace sidestep::python
