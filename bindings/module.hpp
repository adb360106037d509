#pragma once

#include <nanobind/nanobind.h>

namespace sidestep::python {

// One per core folder, in the order of the chain.
void bind_kinematics(nanobind::module_& m);
void bind_body(nanobind::module_& m);
void bind_obstacles(nanobind::module_& m);
void bind_embedding(nanobind::module_& m);
void bind_geometry(nanobind::module_& m);
void bind_dynamical_system(nanobind::module_& m);
void bind_control(nanobind::module_& m);
void bind_batch(nanobind::module_& m);
void bind_guidance(nanobind::module_& m);
void bind_arm(nanobind::module_& m);
void bind_controller(nanobind::module_& m);
void bind_sources(nanobind::module_& m);
void bind_recording(nanobind::module_& m);
void bind_recorded_run(nanobind::module_& m);
void bind_depth_camera(nanobind::module_& m);
void bind_perception(nanobind::module_& m);
void bind_loop(nanobind::module_& m);
void bind_robot_state(nanobind::module_& m);
void bind_model_loop(nanobind::module_& m);
void bind_link(nanobind::module_& m);
void bind_stream_limiter(nanobind::module_& m);
void bind_simulator(nanobind::module_& m);
void bind_thesis(nanobind::module_& m);

}  // namespace sidestep::python
