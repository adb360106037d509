#include "module.hpp"

NB_MODULE(_core, m) {
  m.doc() = "C++ core of sidestep. Use the names re-exported by the sidestep package.";
  m.attr("__version__") = SIDESTEP_VERSION;
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
  sidestep::python::bind_controller(m);
  sidestep::python::bind_real_time(m);
}
