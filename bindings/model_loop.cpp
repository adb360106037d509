#include "sidestep/loop/model_loop.hpp"

#include <nanobind/stl/string.h>

#include <string>
#include <utility>

#include "arguments.hpp"
#include "module.hpp"
#include "robot_state.hpp"
#include "settings.hpp"

namespace sidestep::python {
namespace {

/// A run of a model as Python holds it.
class PythonModelLoop {
 public:
  PythonModelLoop(nb::object controller, const LoopSettings& settings)
      : controller_(std::move(controller)),
        used_(const_cast<Controller&>(as_instance<Controller>(controller_, "controller", "a Controller"))),
        state_(used_.num_coordinates()),
        loop_(used_, settings) {}

  Command cycle(nb::handle q, nb::handle v, nb::handle mass_matrix, nb::handle bias, nb::handle time) {
    const Eigen::Index nv = used_.num_coordinates();
    state_.q = as_vector(q, "q", nv);
    state_.v = as_vector(v, "v", nv);
    state_.time = as_seconds(time, "time");
    set_dynamics(state_, mass_matrix, bias);
    return loop_.cycle(state_);
  }
  ModelLoop& loop() noexcept { return loop_; }

 private:
  nb::object controller_;
  Controller& used_;
  RobotState state_;
  ModelLoop loop_;
};

}  // namespace

void bind_model_loop(nb::module_& m) {
  nb::class_<PythonModelLoop>(
      m, "ModelLoop",
      "The loop of a model that you move yourself, such as a simulation: one cycle of `Loop` per call, in your thread and in the model's\n"
      "time. Nothing is checked before the first motion: a model shows what the controller does in any state. Without settings nothing\n"
      "ends it but `stop`, or a time that jumps by more than 10 s. Between two cycles the controller is free for you.")
      .def(
          "__init__",
          [](PythonModelLoop* self, nb::object controller, nb::handle settings) {
            new (self) PythonModelLoop(std::move(controller),
                                       settings.is_none() ? ModelLoop::usual_settings()
                                                          : as_instance<LoopSettings>(settings, "settings", "LoopSettings or None"));
          },
          nb::arg("controller"), nb::arg("settings") = nb::none(),
          nb::sig("def __init__(self, controller: Controller, settings: LoopSettings | None = None) -> None"))
      .def("cycle", &PythonModelLoop::cycle, nb::arg("q").none(), nb::arg("v").none(), nb::arg("mass_matrix") = nb::none(),
           nb::arg("bias") = nb::none(), nb::kw_only(), nb::arg("time") = nb::none(),
           nb::sig("def cycle(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, mass_matrix: numpy.typing.ArrayLike | None = None, "
                   "bias: numpy.typing.ArrayLike | None = None, *, time: float | None = None) -> Command"),
           "One cycle at a state, see `Controller.step` for what is given; the command, for you to carry out. The first cycle restarts the\n"
           "controller's reference at the state. Raises ValueError on wrong shapes, RuntimeError once the run is over or while the\n"
           "controller is in use.")
      .def(
          "stop",
          [](PythonModelLoop& self, nb::handle end, const std::string& why) { self.loop().stop(as_enum<RunEnd>(end, "end"), why); },
          nb::arg("end") = "stopped", nb::arg("why") = "",
          nb::sig("def stop(self, end: RunEnd | str = 'stopped', why: str = '') -> None"),
          "Ends the run: the cycles that follow bring the arm to rest. The first reason counts.")
      .def_prop_ro("is_over", [](PythonModelLoop& self) { return self.loop().is_over(); }, "Whether the arm is at rest after the end: no cycle follows.")
      .def("report", [](PythonModelLoop& self) { return self.loop().report(); }, "The RunReport: of the run once it is over, before of why it is ending.")
      .def("__repr__", [](PythonModelLoop& self) { return std::string("ModelLoop(") + (self.loop().is_over() ? "over)" : "running)"); });
}

}  // namespace sidestep::python
