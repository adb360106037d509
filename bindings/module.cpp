#include "module.hpp"

NB_MODULE(_core, m) {
  m.doc() = "C++ core of sidestep. Use the names re-exported by the sidestep package.";
  m.attr("__version__") = SIDESTEP_VERSION;
#ifdef NDEBUG
  // A thread of the user's that does not end with the program, as one that a camera feeds, holds its controller until exit. Python
  // frees nothing of such threads, which is no leak that a user should be told of. Debug builds tell.
  nanobind::set_leak_warnings(false);
#endif
  sidestep::python::bind_kinematics(m);
  sidestep::python::bind_body(m);
  sidestep::python::bind_obstacles(m);
  sidestep::python::bind_embedding(m);
  sidestep::python::bind_geometry(m);
  sidestep::python::bind_dynamical_system(m);
  sidestep::python::bind_control(m);
  sidestep::python::bind_batch(m);
  sidestep::python::bind_guidance(m);
  sidestep::python::bind_arm(m);
  sidestep::python::bind_recording(m);
  sidestep::python::bind_controller(m);
  sidestep::python::bind_recorded_run(m);
  sidestep::python::bind_sources(m);
  sidestep::python::bind_depth_camera(m);
  sidestep::python::bind_perception(m);
  sidestep::python::bind_loop(m);
  sidestep::python::bind_link(m);
  sidestep::python::bind_stream_limiter(m);
  sidestep::python::bind_simulator(m);
  sidestep::python::bind_thesis(m);
}
