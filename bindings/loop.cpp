#include "sidestep/control/loop.hpp"

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "dynamical_system.hpp"
#include "module.hpp"
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
            const LoopStatus status = self.step(position, velocity, M, h);
            return LoopStep{status.system, self.solution()};
          },
          nb::arg("q"), nb::arg("v"), nb::arg("mass_matrix"), nb::arg("bias"),
          "One period at q (nv,) [rad | m] and v (nv,) [/s], with mass matrix (nv, nv) and bias (nv,) [Nm | N] there.\n"
          "Values that are not finite give a fallback status and a damped stop. Raises ValueError on wrong shapes.");

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
        nb::gil_scoped_release release;
        return evaluate_batch(system, positions, velocities, targets, obstacles, threads);
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goals"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("threads") = 0,
      "One step at each of N states q, v (N, nv) towards goals (N, nv), on several threads (0: one per processor).\n"
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
        nb::gil_scoped_release release;
        return rollout_batch(system, positions, velocities, targets, obstacles, settings, threads);
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goals"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("period") = 0.001, nb::arg("steps"), nb::arg("integrator") = "semi_implicit_euler",
      nb::arg("filter") = nb::none(), nb::arg("threads") = 0,
      nb::sig("def rollout_batch(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
              "goals: numpy.typing.ArrayLike, obstacles: Obstacles, *, period: float = 0.001, steps: int, "
              "integrator: Integrator | str = 'semi_implicit_euler', filter: AccelerationFilter | None = None, "
              "threads: int = 0) -> list[Rollout]"),
      "The motions from N states q, v (N, nv) towards goals (N, nv) as `rollout` gives them, on several threads\n"
      "(0: one per processor). Raises ValueError on wrong shapes.");
}

}  // namespace sidestep::python
