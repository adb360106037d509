#include "sidestep/control/loop.hpp"

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <thread>

#include "dynamical_system.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "sidestep/control/real_time.hpp"
#include "sidestep/dynamical_system/batch.hpp"

namespace sidestep::python {
namespace {

struct LoopStep {
  StepStatus status;
  TorqueSolution solution;
};

Eigen::MatrixXd as_rows(nb::handle value, const char* name, Eigen::Index nv) {
  const Array array = as_array(value, name);
  if (array.ndim() != 2 || static_cast<Eigen::Index>(array.shape(1)) != nv) {
    throw nb::value_error((std::string(name) + " must have shape (N, " + std::to_string(nv) + ")").c_str());
  }
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      array.data(), static_cast<Eigen::Index>(array.shape(0)), nv);
}

}  // namespace

void bind_loop(nb::module_& m) {
  nb::class_<LoopStep>(m, "LoopStep", "What one step of the loop gives.")
      .def_ro("status", &LoopStep::status, "StepStatus of the system.")
      .def_ro("solution", &LoopStep::solution, "TorqueSolution of the controller.")
      .def_prop_ro("torque", [](const LoopStep& s) { return to_numpy(s.solution.torque); },
                   "(nv,) [Nm | N], within the effort limits, always finite.");

  nb::class_<Loop>(m, "Loop",
                   "The whole control loop, state in and torque out: a GeometricSystem and a TorqueController, which gets\n"
                   "the clearances that the system measured. Goal and obstacles may be replaced from another thread while\n"
                   "a step runs. Raises ValueError if system and controller differ in their number of coordinates.")
      .def(
          "__init__",
          [](Loop* self, std::shared_ptr<GeometricSystem> system, const TorqueController& controller, nb::handle goal,
             const Obstacles& obstacles) {
            const Goal target = as_goal(goal, system->robot().num_coordinates());
            new (self) Loop(std::move(system), controller, target, obstacles);
          },
          nb::arg("system"), nb::arg("controller"), nb::kw_only(), nb::arg("goal"), nb::arg("obstacles"),
          nb::sig("def __init__(self, system: GeometricSystem, controller: TorqueController, *, "
                  "goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles) -> None"))
      .def(
          "set_goal",
          [](Loop& self, nb::handle goal) { self.set_goal(as_goal(goal, self.system().robot().num_coordinates())); },
          nb::arg("goal"),
          nb::sig("def set_goal(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal) -> None"),
          "From the next step on.")
      .def("set_obstacles", &Loop::set_obstacles, nb::arg("obstacles"), "From the next step on.")
      .def(
          "step",
          [](Loop& self, const ArrayLike& q, const ArrayLike& v, const ArrayLike& mass_matrix, const ArrayLike& bias) {
            const int nv = self.system().robot().num_coordinates();
            const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv),
                                  h = as_vector(bias, "bias", nv);
            const Eigen::MatrixXd M = as_matrix(mass_matrix, "mass_matrix", nv, nv);
            const Loop::Use use(self);
            const LoopStatus status = self.step(position, velocity, M, h);
            return LoopStep{status.system, self.solution()};
          },
          nb::arg("q"), nb::arg("v"), nb::arg("mass_matrix"), nb::arg("bias"),
          "One period at q (nv,) [rad | m] and v (nv,) [/s], with mass matrix (nv, nv) and bias (nv,) [Nm | N] there.\n"
          "Values that are not finite give a fallback status and a damped stop. Raises ValueError on wrong shapes,\n"
          "RuntimeError while a RealTimeRun has the loop.");

  nb::class_<RealTimeRun>(
      m, "RealTimeRun",
      "Runs a Loop at its period by the machine's clock, in a thread of its own, from q, v (nv,): step k is due k + 1 periods\n"
      "after the start, and what is late is not left out. The arm is integrated with the acceleration that was commanded;\n"
      "mass_matrix (nv, nv) and bias (nv,) stay as they are given. Until it has ended the loop is its alone, but for\n"
      "`Loop.set_goal` and `Loop.set_obstacles`. period [s], at most 60; steps: at most 100,000,000; priority: ask for real-time\n"
      "scheduling. Raises ValueError on wrong shapes, what is not finite, and settings at fault, RuntimeError if the loop is in use.")
      .def(
          "__init__",
          [](RealTimeRun* self, Loop& loop, const ArrayLike& q, const ArrayLike& v, const ArrayLike& mass_matrix,
             const ArrayLike& bias, double period, int steps, bool priority) {
            const int nv = loop.system().robot().num_coordinates();
            new (self) RealTimeRun(loop, {as_vector(q, "q", nv), as_vector(v, "v", nv)},
                                   as_matrix(mass_matrix, "mass_matrix", nv, nv), as_vector(bias, "bias", nv),
                                   {period, steps, priority});
          },
          nb::arg("loop"), nb::arg("q"), nb::arg("v"), nb::arg("mass_matrix"), nb::arg("bias"), nb::kw_only(),
          nb::arg("period") = RealTimeSettings().period, nb::arg("steps") = RealTimeSettings().steps,
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
      .def("stop", &RealTimeRun::stop, "Asks for the end after the step at hand, and waits for nothing: `finish` does.");
  nb::class_<RealTimeRecord>(m, "RealTimeRecord", "When the steps of a real-time run began and ended.")
      .def_prop_ro("late", [](const RealTimeRecord& r) { return to_numpy(r.late); },
                   "(T,) [s] from when a step was due to when it began.")
      .def_prop_ro("taken", [](const RealTimeRecord& r) { return to_numpy(r.taken); },
                   "(T,) [s] from when it began to when its torque was there.")
      .def_ro("missed", &RealTimeRecord::missed, "Steps that ended after the next one was due.")
      .def_ro("prioritised", &RealTimeRecord::prioritised, "Whether real-time scheduling was granted.");

  nb::class_<BatchEvaluation> batch(m, "BatchEvaluation", "One step at each of N states.");
  matrix_property(batch, "accelerations", &BatchEvaluation::accelerations, "(N, nv) [rad/s^2]");
  matrix_property(batch, "values", &BatchEvaluation::values, "psi (N, m); NaN where the step fell back");
  batch.def_ro("statuses", &BatchEvaluation::statuses, "One StepStatus per state.");

  m.def(
      "evaluate_batch",
      [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, const ArrayLike& goals,
         const Obstacles& obstacles, int threads) {
        const int nv = system.robot().num_coordinates();
        const Eigen::MatrixXd positions = as_rows(q, "q", nv), velocities = as_rows(v, "v", nv),
                              targets = as_rows(goals, "goals", nv);
        const HeldObstacles held(obstacles);
        return interruptible([&](const Interrupted& interrupted) {
          return evaluate_batch(system, positions, velocities, targets, held, threads, interrupted);
        });
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goals"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("threads") = 0,
      "One step at each of N states q, v (N, nv) towards goals (N, nv), on several threads (0: one per processor).\n"
      "A system with one embedding coordinate that is no clearance (CollisionDensity, JointLimitPotential, their Sum), with\n"
      "neither distance switch nor speed regulator nor one-sided pull, takes eight states side by side: as single steps within\n"
      "rounding (1e-12 relative), in a third of the time.\n"
      "Raises ValueError on wrong shapes.");
  m.def(
      "rollout_batch",
      [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, const ArrayLike& goals,
         const Obstacles& obstacles, double period, int steps, nb::handle integrator, const AccelerationFilter* filter,
         int threads) {
        const int nv = system.robot().num_coordinates();
        const Eigen::MatrixXd positions = as_rows(q, "q", nv), velocities = as_rows(v, "v", nv),
                              targets = as_rows(goals, "goals", nv);
        RolloutSettings settings{period, steps, as_enum<Integrator>(integrator, "integrator")};
        if (filter != nullptr) {
          settings.filter = *filter;
        }
        const HeldObstacles held(obstacles);
        return interruptible([&](const Interrupted& interrupted) {
          settings.interrupted = interrupted;
          return rollout_batch(system, positions, velocities, targets, held, settings, threads);
        });
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goals"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("period") = 0.001, nb::arg("steps"), nb::arg("integrator") = "semi_implicit_euler",
      nb::arg("filter") = nb::none(), nb::arg("threads") = 0,
      nb::sig("def rollout_batch(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
              "goals: numpy.typing.ArrayLike, obstacles: Obstacles, *, period: float = 0.001, steps: int, "
              "integrator: Integrator | str = 'semi_implicit_euler', filter: AccelerationFilter | None = None, "
              "threads: int = 0) -> list[Rollout]"),
      "The motions from N states q, v (N, nv) towards goals (N, nv) as `rollout` gives them, on several threads\n"
      "(0: one per processor). Those that `evaluate_batch` would take side by side are, without a filter and but for\n"
      "runge_kutta_4: each step is then that of `rollout` within rounding. Raises ValueError on wrong shapes.");
}

}  // namespace sidestep::python
