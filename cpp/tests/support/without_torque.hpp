#pragma once

#include "sidestep/constraints/motion_program.hpp"

namespace sidestep::test {

/// Settings of a program for an arm that is not moved by torque.
inline MotionProgramSettings without_torque() {
  MotionProgramSettings settings;
  settings.by_torque = false;
  return settings;
}

}  // namespace sidestep::test
