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

/// A black box of a controller that outlives it.
struct BlackBoxInProgress {
  Controller* controller;
  std::filesystem::path folder;
  std::optional<BlackBoxSummary> summary;  // Summary, once it has ended.

  BlackBoxSummary stop();
};

}  // namespace sidestep::python
