#include "sidestep/controller/real_time.hpp"

#include <chrono>
#include <thread>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"

namespace sidestep::python {

void bind_real_time(nb::module_& m) {
  nb::class_<RealTimeRun>(
      m, "RealTimeRun",
      "Runs a Controller at its period by the machine's clock, in a thread of its own, from q, v (nv,): step k is due k + 1\n"
      "periods after the start, and late steps are not skipped. The arm is an ideal robot: v += a T, q += v T. Until the run\n"
      "ends the controller is reserved for it: others may only set goals and obstacles, and read what the planner knows. steps: at most 100,000,000,\n"
      "of which the record takes 1.6 GB; priority: ask for real-time scheduling. Raises ValueError on wrong shapes, what is not finite, and settings at fault,\n"
      "RuntimeError if the controller is in use.")
      .def(
          "__init__",
          [](RealTimeRun* self, Controller& controller, const ArrayLike& q, const ArrayLike& v, std::int64_t steps, bool priority) {
            const int nv = controller.arm().num_coordinates();
            new (self) RealTimeRun(controller, {as_vector(q, "q", nv), as_vector(v, "v", nv)}, {steps, priority});
          },
          nb::arg("controller"), nb::arg("q"), nb::arg("v"), nb::kw_only(), nb::arg("steps") = RealTimeSettings().steps,
          nb::arg("priority") = RealTimeSettings().priority, nb::keep_alive<1, 2>())
      .def_prop_ro("running", &RealTimeRun::running, "Whether steps are left.")
      .def(
          "state",
          [](RealTimeRun& self) {
            const ArmState& now = self.state();
            return nb::make_tuple(to_numpy(now.q), to_numpy(now.v));
          },
          nb::sig("def state(self) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]"),
          "q, v (nv,) before the next step; for one thread.")
      .def(
          "finish",
          [](RealTimeRun& self) {
            try {
              interruptible([&](const Interrupted& interrupted) {
                while (self.running() && !interrupted()) {
                  std::this_thread::sleep_for(std::chrono::milliseconds(5));
                }
                return true;
              });
            } catch (...) {
              self.stop();
              throw;
            }
            return self.finish();
          },
          "Waits for the end; the RealTimeRecord of the steps done. Ctrl-C stops the run.")
      .def("stop", &RealTimeRun::stop, "Asks for the end after the step at hand, and waits for nothing: `finish` does.")
      .def("__repr__", [](const RealTimeRun& self) { return std::string("RealTimeRun(") + (self.running() ? "running)" : "ended)"); });
  nb::class_<RealTimeRecord>(m, "RealTimeRecord", "When the steps of a real-time run began and ended.")
      .def_prop_ro("late", [](const RealTimeRecord& r) { return to_numpy(r.late); },
                   "(T,) [s] from when a step was due to when it began.")
      .def_prop_ro("taken", [](const RealTimeRecord& r) { return to_numpy(r.taken); },
                   "(T,) [s] from when it began to when its command was there.")
      .def_ro("missed", &RealTimeRecord::missed, "Steps that ended after the next one was due.")
      .def_ro("prioritised", &RealTimeRecord::prioritised, "Whether real-time scheduling was granted.")
      .def("__repr__", [](const RealTimeRecord& r) {
        return "RealTimeRecord(" + std::to_string(r.taken.size()) + " steps, " + std::to_string(r.missed) + " missed)";
      });
}

}  // namespace sidestep::python
