#pragma once

#include <nanobind/nanobind.h>

#include "sidestep/loop/robot_state.hpp"

namespace sidestep::python {

/// The robot's own dynamics (nv, nv), (nv), or nothing for None.
void set_dynamics(RobotState& state, nanobind::handle mass_matrix, nanobind::handle bias);

}  // namespace sidestep::python
