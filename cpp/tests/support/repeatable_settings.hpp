#pragma once

#include "sidestep/controller/controller.hpp"

namespace sidestep::test {

/// The defaults, with everything in the step's own thread, so that motions repeat.
inline ControllerSettings repeatable_settings(ControllerSettings::Output output) {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.output = output;
  return settings;
}

}  // namespace sidestep::test
