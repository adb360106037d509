#include "module.hpp"

NB_MODULE(_core, m) {
  m.doc() = "C++ core of sidestep. Use the names re-exported by the sidestep package.";
  m.attr("__version__") = SIDESTEP_VERSION;
  sidestep::python::bind_kinematics(m);
  sidestep::python::bind_body(m);
  sidestep::python::bind_obstacles(m);
  sidestep::python::bind_control(m);
}
