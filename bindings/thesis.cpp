#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <vector>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "sidestep/thesis/collision_density.hpp"
#include "sidestep/thesis/joint_limit_potential.hpp"
#include "sidestep/thesis/rollout.hpp"
#include "sidestep/thesis/rollout_batch.hpp"
#include "sidestep/thesis/sum.hpp"
#include "system.hpp"

namespace sidestep::python {
namespace {

void bind_densities(nb::module_& m) {
  nb::class_<CollisionDensity, Embedding>(
      m, "CollisionDensity",
      "The thesis's embedding: the body's Gaussian mixture at the obstacle points (Bosc 2024, T3.1-T3.7),\n"
      "    psi(q) = sum_points sum_links sum_k pi_k N(x | o_l + R_l mu_k, R_l Sigma_k R_l^T + r^2 I)  [1/m^3].\n"
      "`average` divides by the number of points. Links that no joint moves are left out.")
      .def_prop_ro_static("operations_per_pair", [](nb::handle) { return CollisionDensity::operations_per_pair; },
                           "Multiplications and additions for a Gaussian and a point at rest without radius.")
      .def(
          "__init__",
          [](CollisionDensity* self, const Robot& robot, const Body& body, bool average) {
            check_fitted_to(robot, body);
            new (self) CollisionDensity(robot, body, average);
          },
          nb::arg("robot"), nb::arg("body"), nb::kw_only(), nb::arg("average") = false);

  nb::class_<JointLimitPotential, Embedding>(
      m, "JointLimitPotential",
      "Smooth steps at the joint limits (Bosc 2024, T5.7, corrected to a sum over the joints),\n"
      "    zeta(q) = height sum_j [s(slope (q_j - upper_j)) + s(slope (lower_j - q_j))],  s(u) = 1/(1 + exp(-u)).\n"
      "slope [1/rad]; height in the unit of the coordinate it is added to.")
      .def(nb::init<const Robot&, double, double>(), nb::arg("robot"), nb::kw_only(), nb::arg("slope") = 30.0,
           nb::arg("height") = 1.0);

  nb::class_<Sum, Embedding>(m, "Sum",
                             "Embeddings added into the same coordinates, psi = sum_i psi_i (the thesis's T5.8).")
      .def(nb::init<std::vector<std::shared_ptr<const Embedding>>>(), nb::arg("terms"));
}

void bind_rollouts(nb::module_& m) {
  nb::enum_<Integrator>(m, "Integrator", "How a step of length dt is taken.")
      .value("semi_implicit_euler", Integrator::semi_implicit_euler, "v += a dt; q += v dt.")
      .value("second_order", Integrator::second_order, "q += v dt + a dt^2/2; v += a dt (thesis 6.2.1).")
      .value("runge_kutta_4", Integrator::runge_kutta_4, "The classical scheme, with the obstacles moved along.");

  nb::class_<Rollout> result(m, "Rollout", "A kinematic motion: row k is at time k dt, steps + 1 rows.");
  result.def_prop_ro("time", [](const Rollout& r) { return to_numpy(r.time); }, "[s]")
      .def_ro("statuses", &Rollout::statuses, "One StepStatus per row.")
      .def_prop_ro("step_seconds", [](const Rollout& r) { return to_numpy(r.step_seconds); },
                   "(steps + 1,) wall time [s] of the acceleration of each row; empty without time_steps.");
  matrix_property(result, "q", &Rollout::q, "(steps + 1, nv) [rad]");
  matrix_property(result, "v", &Rollout::v, "(steps + 1, nv) [rad/s]");
  matrix_property(result, "acceleration", &Rollout::acceleration, "(steps + 1, nv) [rad/s^2]");
  matrix_property(result, "values", &Rollout::values, "psi (steps + 1, m)");
  matrix_property(result, "switch", &Rollout::switch_weights, "Weights of the harmonic part (steps + 1, nv)");

  m.def(
      "rollout",
      [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, nb::handle goal, const Obstacles& obstacles,
         double period, int steps, nb::handle integrator, bool time_steps) {
        const int nv = system.robot().num_coordinates();
        const Eigen::VectorXd start = as_vector(q, "q", nv);
        const Eigen::VectorXd velocity = as_vector(v, "v", nv);
        const Goal target = as_goal(goal, nv);
        RolloutSettings settings{period, steps, as_enum<Integrator>(integrator, "integrator"), time_steps};
        const HeldObstacles held(obstacles);
        return interruptible([&](const Interrupted& interrupted) {
          settings.interrupted = interrupted;
          return rollout(system, start, velocity, target, held, settings);
        });
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goal"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("period") = 0.001, nb::arg("steps"), nb::arg("integrator") = "semi_implicit_euler",
      nb::arg("time_steps") = false,
      nb::sig("def rollout(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
              "goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles, *, period: float = 0.001, "
              "steps: int, "
              "integrator: Integrator | str = 'semi_implicit_euler', time_steps: bool = False) -> Rollout"),
      "Integrates the system alone from q, v (nv,) towards a goal, obstacles and goal moving at their velocities; nothing holds\n"
      "limits or clearances: what has to keep them is a Controller, see `integrate`.\n"
      "period dt [s]; steps: the record may have 8 GiB; integrator: an Integrator or its name; time_steps: measure every step, see step_seconds.");

  m.def(
      "rollout_batch",
      [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, const ArrayLike& goals,
         const Obstacles& obstacles, double period, int steps, nb::handle integrator, int threads) {
        const int nv = system.robot().num_coordinates();
        const Eigen::MatrixXd positions = as_rows(q, "q", nv), velocities = as_rows(v, "v", nv),
                              targets = as_rows(goals, "goals", nv);
        RolloutSettings settings{period, steps, as_enum<Integrator>(integrator, "integrator")};
        const HeldObstacles held(obstacles);
        return interruptible([&](const Interrupted& interrupted) {
          settings.interrupted = interrupted;
          return rollout_batch(system, positions, velocities, targets, held, settings, threads);
        });
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goals"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("period") = 0.001, nb::arg("steps"), nb::arg("integrator") = "semi_implicit_euler",
      nb::arg("threads") = 0,
      nb::sig("def rollout_batch(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
              "goals: numpy.typing.ArrayLike, obstacles: Obstacles, *, period: float = 0.001, steps: int, "
              "integrator: Integrator | str = 'semi_implicit_euler', "
              "threads: int = 0) -> list[Rollout]"),
      "The motions from N states q, v (N, nv) towards goals (N, nv) as `rollout` gives them, on several threads\n"
      "(0: one per processor). Raises ValueError on wrong shapes.");
}

}  // namespace

void bind_thesis(nb::module_& m) {
  bind_densities(m);
  bind_rollouts(m);
}

}  // namespace sidestep::python
