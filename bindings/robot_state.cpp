#include "robot_state.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <limits>
#include <utility>

#include "arguments.hpp"
#include "module.hpp"
#include "system.hpp"
#include "sidestep/loop/driver.hpp"

namespace sidestep::python {
namespace {

using Output = ControllerSettings::Output;

/// A vector (nv) or, for None, what is unknown.
Eigen::VectorXd as_known(nb::handle value, const char* name, Eigen::Index nv) {
  return value.is_none() ? Eigen::VectorXd(Eigen::VectorXd::Constant(nv, std::numeric_limits<double>::quiet_NaN()))
                         : as_vector(value, name, nv);
}

}  // namespace

void set_dynamics(RobotState& state, nb::handle mass_matrix, nb::handle bias) {
  if (mass_matrix.is_none() != bias.is_none()) {
    throw nb::value_error("mass_matrix and bias go together: give both or none");
  }
  const Eigen::Index nv = mass_matrix.is_none() ? 0 : state.q.size();
  state.mass_matrix.resize(nv, nv);
  state.bias.resize(nv);
  if (nv > 0) {
    state.mass_matrix = as_matrix(mass_matrix, "mass_matrix", nv, nv);
    state.bias = as_vector(bias, "bias", nv);
  }
}

void bind_robot_state(nb::module_& m) {
  nb::class_<RobotState>(m, "RobotState", "What a robot says of itself in one cycle.")
      .def(
          "__init__",
          [](RobotState* self, const ArrayLike& q, const ArrayLike& v, nb::handle time, nb::handle torque, nb::handle told_position,
             nb::handle told_velocity, nb::handle told_acceleration, int lost_cycles, nb::handle mass_matrix, nb::handle bias) {
            const Eigen::VectorXd at = as_vector(q, "q");
            new (self) RobotState(static_cast<int>(at.size()));
            self->q = at;
            self->v = as_vector(v, "v", at.size());
            self->time = as_seconds(time, "time");
            self->torque = as_known(torque, "torque", at.size());
            self->told_position = as_known(told_position, "told_position", at.size());
            self->told_velocity = as_known(told_velocity, "told_velocity", at.size());
            self->told_acceleration = as_known(told_acceleration, "told_acceleration", at.size());
            self->lost_cycles = lost_cycles;
            set_dynamics(*self, mass_matrix, bias);
          },
          nb::arg("q"), nb::arg("v"), nb::kw_only(), nb::arg("time") = nb::none(), nb::arg("torque") = nb::none(),
          nb::arg("told_position") = nb::none(), nb::arg("told_velocity") = nb::none(), nb::arg("told_acceleration") = nb::none(),
          nb::arg("lost_cycles") = 0, nb::arg("mass_matrix") = nb::none(), nb::arg("bias") = nb::none(),
          nb::sig("def __init__(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, time: float | None = None, torque: "
                  "numpy.typing.ArrayLike | None = None, told_position: numpy.typing.ArrayLike | None = None, told_velocity: "
                  "numpy.typing.ArrayLike | None = None, told_acceleration: numpy.typing.ArrayLike | None = None, lost_cycles: int = 0, "
                  "mass_matrix: numpy.typing.ArrayLike | None = None, bias: numpy.typing.ArrayLike | None = None) -> None"),
          "q, v (nv,) measured [rad | m], [/s]. mass_matrix (nv, nv) and bias (nv,) [Nm | N], both or neither: the robot's own dynamics\n"
          "there, for which the torques are computed then. Raises ValueError on wrong shapes.")
      .def_ro("time", &RobotState::time,
              "When it was measured [s]: on the machine's monotonic clock (`time.monotonic()`), or on the model's clock of a\n"
              "simulation; nan: the robot does not say.")
      .def_prop_ro("q", [](const RobotState& s) { return to_numpy(s.q); }, "(nv,) measured [rad | m].")
      .def_prop_ro("v", [](const RobotState& s) { return to_numpy(s.v); }, "(nv,) measured [rad/s | m/s].")
      .def_prop_ro("torque", [](const RobotState& s) { return to_numpy(s.torque); },
                   "(nv,) measured, gravity included [Nm | N]; nan: the robot does not say.")
      .def_prop_ro("told_position", [](const RobotState& s) { return to_numpy(s.told_position); },
                   "(nv,) what the robot goes on from, if it interpolates what it is sent [rad | m]; nan: it does not say.")
      .def_prop_ro("told_velocity", [](const RobotState& s) { return to_numpy(s.told_velocity); }, "(nv,) the same [rad/s | m/s].")
      .def_prop_ro("told_acceleration", [](const RobotState& s) { return to_numpy(s.told_acceleration); },
                   "(nv,) the same [rad/s^2 | m/s^2].")
      .def_ro("lost_cycles", &RobotState::lost_cycles, "Cycles since the state before in which the robot went on without a command.")
      .def("__repr__", [](const RobotState& s) {
        return "RobotState(q=" + in_short(s.q) + ", v=" + in_short(s.v) + ", time=" + in_short(s.time) + ")";
      });
  nb::class_<RobotDescription>(m, "RobotDescription", "What a driver says of its robot, once.")
      .def(
          "__init__",
          [](RobotDescription* self, std::string name, double period, const std::vector<std::string>& outputs,
             std::vector<std::string> joints, const std::optional<JointLimits>& limits, bool paced, bool real_time,
             std::string when_silent) {
            RobotDescription made;
            made.name = std::move(name);
            made.joints = std::move(joints);
            made.limits = limits.value_or(JointLimits{});
            for (const std::string& output : outputs) {
              made.outputs.push_back(as_enum<Output>(nb::str(output.c_str()), "outputs"));
            }
            made.period = period;
            made.paced = paced;
            made.real_time = real_time;
            made.when_silent = std::move(when_silent);
            made.validate();
            new (self) RobotDescription(std::move(made));
          },
          nb::arg("name"), nb::kw_only(), nb::arg("period"), nb::arg("outputs"), nb::arg("joints") = std::vector<std::string>{},
          nb::arg("limits") = nb::none(), nb::arg("paced") = true, nb::arg("real_time") = true, nb::arg("when_silent") = "not told",
          "period: of its cycle [s]; outputs: what it takes, of \"torque\", \"acceleration\", \"velocity\", \"position\"; joints: names in\n"
          "the order of its state, compared with the arm's; limits: of the robot, which the arm's must not exceed; paced: `read` waits\n"
          "for the robot's cycle, else the loop's own clock is the pace; real_time: False for a model on its own clock; when_silent:\n"
          "what it does when nobody writes, in words. Raises ValueError that names what is wrong.")
      .def_ro("name", &RobotDescription::name, "Its name.")
      .def_ro("joints", &RobotDescription::joints, "Names of its joints, in the order of its state; empty: it does not say.")
      .def_ro("period", &RobotDescription::period, "Of its cycle [s].")
      .def_prop_ro("outputs",
                   [](const RobotDescription& d) {
                     std::vector<std::string> names;
                     for (const Output output : d.outputs) {
                       names.emplace_back(to_string(output));
                     }
                     return names;
                   },
                   "What it takes.")
      .def_ro("paced", &RobotDescription::paced, "Whether `read` waits for its cycle.")
      .def_ro("real_time", &RobotDescription::real_time, "False: a model on its own clock.")
      .def_ro("when_silent", &RobotDescription::when_silent, "What it does when nobody writes, in words.")
      .def("__repr__", [](const RobotDescription& d) { return "RobotDescription('" + d.name + "')"; });
}

}  // namespace sidestep::python
