#pragma once

#include <nanobind/nanobind.h>

namespace sidestep::python {

// One per core folder, in the order of the chain.
void bind_kinematics(nanobind::module_& m);
void bind_body(nanobind::module_& m);
void bind_obstacles(nanobind::module_& m);
void bind_control(nanobind::module_& m);

}  // namespace sidestep::python
