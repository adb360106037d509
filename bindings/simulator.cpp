#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "os_errors.hpp"
#include "system.hpp"
#include "sidestep/link/robot_port.hpp"
#include "sidestep/link/simulator_driver.hpp"

namespace sidestep::python {
namespace {

using Output = ControllerSettings::Output;

constexpr double pause_of_signals = 0.2;  // Longest wait without a look at Ctrl-C [s].

Eigen::VectorXd told(nb::handle value, const char* name, Eigen::Index nv) {
  return value.is_none() ? Eigen::VectorXd(Eigen::VectorXd::Constant(nv, std::numeric_limits<double>::quiet_NaN()))
                         : as_vector(value, name, nv);
}

link::RobotHello hello_of(std::string name, std::vector<std::string> joints, const JointLimits& limits,
                          const std::vector<std::string>& outputs, double period, bool real_time, std::string when_silent) {
  link::RobotHello hello;
  hello.name = std::move(name);
  hello.joints = std::move(joints);
  hello.limits = limits;
  for (const std::string& output : outputs) {
    hello.outputs.push_back(as_enum<Output>(nb::str(output.c_str()), "outputs"));
  }
  hello.period = period;
  hello.real_time = real_time;
  hello.when_silent = std::move(when_silent);
  return hello;
}

std::optional<link::RobotRequest> receive(link::RobotPort& port, double timeout) {
  return interruptible([&](const Interrupted& interrupted) {
    std::optional<link::RobotRequest> request;
    for (double left = timeout;; left -= pause_of_signals) {
      request = port.receive(std::clamp(left, 0.0, pause_of_signals));
      if (request || left <= pause_of_signals || interrupted()) {
        return request;
      }
    }
  });
}

void send_state(link::RobotPort& port, std::uint64_t cycle, double time, nb::handle q, nb::handle v, nb::handle torque, int mode,
                std::uint64_t taken, std::uint64_t taken_cycle, int lost_cycles, nb::handle told_position, nb::handle told_velocity,
                nb::handle told_acceleration) {
  link::RobotStateMessage state;
  state.cycle = cycle;
  state.time = time;
  state.q = as_vector(q, "q");
  state.v = as_vector(v, "v", state.q.size());
  state.torque = told(torque, "torque", state.q.size());
  state.told_position = told(told_position, "told_position", state.q.size());
  state.told_velocity = told(told_velocity, "told_velocity", state.q.size());
  state.told_acceleration = told(told_acceleration, "told_acceleration", state.q.size());
  state.lost_cycles = lost_cycles;
  state.mode = static_cast<link::RobotMode>(mode);
  state.taken = taken;
  state.taken_cycle = taken_cycle;
  state.check();
  port.send(state);
}

}  // namespace

void bind_simulator(nb::module_& m) {
  nb::class_<link::RobotRequest>(m, "RobotRequest", "What a driver says to a robot.")
      .def_prop_ro(
          "kind", [](const link::RobotRequest& r) { return std::string(to_string(r.kind)); },
          "\"start\", \"command\", \"stop\", or \"gone\" where the connection of the driver in control has ended.")
      .def_prop_ro(
          "output", [](const link::RobotRequest& r) { return std::string(to_string(r.output)); },
          "Of start and command: \"torque\", \"acceleration\", \"velocity\" or \"position\".")
      .def_ro("sequence", &link::RobotRequest::sequence, "Number of the message.")
      .def_ro("cycle", &link::RobotRequest::cycle, "Of the state that a command answers.")
      .def_prop_ro("values", [](const link::RobotRequest& r) { return to_numpy(r.values); }, "(nv,) of a command, finite.");
  nb::class_<link::RobotPort>(
      m, "RobotPort",
      "Robot's side of a link: a Unix domain socket or a port of this machine's loopback, where drivers and viewers connect. All are told\n"
      "what the robot is and how it is; one of them controls it. Who breaks the protocol is told why and cut off. Messages:\n"
      "cpp/include/sidestep/link/robot_messages.hpp.")
      .def(
          "__init__",
          [](link::RobotPort* self, const std::string& address, std::string name, std::vector<std::string> joints,
             const JointLimits& limits, const std::vector<std::string>& outputs, double period, bool real_time,
             std::string when_silent) {
            with_os_errors(address, [&] {
              new (self) link::RobotPort(address, hello_of(std::move(name), std::move(joints), limits, outputs, period, real_time,
                                                           std::move(when_silent)));
            });
          },
          nb::arg("address"), nb::kw_only(), nb::arg("name"), nb::arg("joints"), nb::arg("limits"), nb::arg("outputs"),
          nb::arg("period"), nb::arg("real_time") = true, nb::arg("when_silent") = "not told",
          "address: \"unix:/PATH\", a name, \"tcp:PORT\" or \"tcp:127.0.0.1:PORT\". The others: see RobotDescription. Raises ValueError on an address\n"
          "or a value that is not allowed, OSError where the address is taken.")
      .def("receive", &receive, nb::arg("timeout"), nb::rv_policy::move,
           "The next RobotRequest, waiting for at most `timeout` [s]; None: there was none. Ctrl-C raises.")
      .def("send_state", &send_state, nb::arg("cycle"), nb::arg("time"), nb::kw_only(), nb::arg("q"), nb::arg("v"),
           nb::arg("torque") = nb::none(), nb::arg("mode") = 1, nb::arg("taken") = 0, nb::arg("taken_cycle") = 0, nb::arg("lost_cycles") = 0,
           nb::arg("told_position") = nb::none(), nb::arg("told_velocity") = nb::none(), nb::arg("told_acceleration") = nb::none(),
           nb::sig("def send_state(self, cycle: int, time: float, *, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, torque: "
                   "numpy.typing.ArrayLike | None = None, mode: int = 1, taken: int = 0, taken_cycle: int = 0, lost_cycles: int = 0, told_position: "
                   "numpy.typing.ArrayLike | None = None, told_velocity: numpy.typing.ArrayLike | None = None, told_acceleration: "
                   "numpy.typing.ArrayLike | None = None) -> None"),
           "Tells everybody how the robot is: vectors (nv,); mode: 0 nobody moves it yet, 1 a driver does, 2 nobody any more, 3 it has\n"
           "stopped itself; taken: number of the newest command that moves it, 0: none, since taken_cycle; lost_cycles: so far without a command.")
      .def(
          "send_objects",
          [](link::RobotPort& self, const std::vector<std::string>& names, nb::handle poses) {
            link::RobotObjects objects;
            objects.names = names;
            objects.poses = as_matrix(poses, "poses", static_cast<Eigen::Index>(names.size()), 7);
            objects.check();
            self.send(objects);
          },
          nb::arg("names"), nb::arg("poses"), nb::sig("def send_objects(self, names: collections.abc.Sequence[str], poses: numpy.typing.ArrayLike) -> None"),
          "Tells viewers where objects are: poses (N, 7), position [m] and quaternion (w, x, y, z) in the world.")
      .def("stop", &link::RobotPort::stop, nb::arg("words"), "Tells the driver in control that the robot has stopped itself, and why.")
      .def_prop_ro("address", &link::RobotPort::address, "As text, with the port that was free.")
      .def_prop_ro("num_connections", &link::RobotPort::num_connections, "Drivers and viewers that are connected.")
      .def_prop_ro("is_controlled", &link::RobotPort::is_controlled, "Whether one of them controls the robot.")
      .def_prop_ro(
          "refusals",
          [](const link::RobotPort& self) { return std::vector<std::string>(self.refusals().begin(), self.refusals().end()); },
          "Why connections were cut off, the last ones first; at most 16.");
  nb::class_<link::SimulatorDriver, Driver>(
      m, "SimulatorDriver",
      "Drives a robot that speaks the messages of a RobotPort, as the simulator of `sidestep simulate` does, without Python in the loop.")
      .def(
          "__init__",
          [](link::SimulatorDriver* self, const std::string& address, double timeout) {
            with_os_errors(address, [&] {
              const nb::gil_scoped_release others;
              new (self) link::SimulatorDriver(address, timeout);
            });
          },
          nb::arg("address"), nb::kw_only(), nb::arg("timeout") = 5.0,
          "address: as that of a RobotPort; timeout: for the robot's first message [s]. Raises OSError where nobody listens, RuntimeError\n"
          "where no robot answers.")
      .def("stop", &link::SimulatorDriver::stop, nb::call_guard<nb::gil_scoped_release>(),
           "Ends control: the robot comes to rest and holds. Not while a run goes on.")
      .def("close", &link::SimulatorDriver::close, "Ends the connection. Not while a run goes on.")
      .def_prop_ro("delay", &link::SimulatorDriver::delay,
                   "From a state to the cycle in which its command moves the robot [s]; with torque or acceleration output, states that are read\n"
                   "are moved on by so much.");
}

}  // namespace sidestep::python
