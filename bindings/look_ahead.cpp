#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "arguments.hpp"
#include "system.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "sidestep/attractor/local_minimum_recovery.hpp"
#include "sidestep/planning/look_ahead.hpp"
#include "sidestep/math/progress_monitor.hpp"

namespace sidestep::python {
namespace {

double as_period(double period) {
  if (!(period > 0.0 && std::isfinite(period))) {
    throw std::invalid_argument("period is " + std::to_string(period) + " s, must be positive and finite");
  }
  return period;
}

}  // namespace

void bind_look_ahead(nb::module_& m) {
  nb::class_<ProgressMonitor>(m, "ProgressMonitor",
                              "Says when a motion has come no nearer to its goal for `patience` [s]: when the goal's\n"
                              "potential has not fallen by `fraction` of its least value.")
      .def(nb::init<double, double>(), nb::kw_only(), nb::arg("patience") = 2.0, nb::arg("fraction") = 0.02)
      .def("update", &ProgressMonitor::update, nb::arg("time"), nb::arg("potential"),
           "Takes `Step.goal_potential` at a time [s]; whether patience has run out.")
      .def("reset", &ProgressMonitor::reset, "For a new goal.");

  nb::class_<LocalMinimumRecovery>(m, "LocalMinimumRecovery",
                     "Leads an arm out of local minima without a map: when it has come no nearer to its goal for `patience` [s],\n"
                     "it follows a random configuration for at most `leg` [s], then its goal again (Barraquand and Latombe 1991):\n"
                     "one uniform within `spread` [rad] of every joint's position and within the limits; the n-th time for one goal within\n"
                     "n times `spread`, for at most n times `leg`. Within 0.01 [rad | m] of its goal it has arrived. A goal that from\n"
                     "one call to the next is more than 0.2 [rad | m] elsewhere is another one, and followed at once.\n"
                     "fraction: of its potential that counts as nearer; seed: of the random configurations.\n"
                     "Raises ValueError that names the setting at fault.")
      .def(
          "__init__",
          [](LocalMinimumRecovery* self, const Robot& robot, double patience, double fraction, double leg, double spread,
             std::uint64_t seed) {
            new (self) LocalMinimumRecovery(robot, {patience, fraction, leg, spread, seed});
          },
          nb::arg("robot"), nb::kw_only(), nb::arg("patience") = LocalMinimumSettings().patience,
          nb::arg("fraction") = LocalMinimumSettings().fraction, nb::arg("leg") = LocalMinimumSettings().leg,
          nb::arg("spread") = LocalMinimumSettings().spread, nb::arg("seed") = LocalMinimumSettings().seed)
      .def(
          "pursue",
          [](LocalMinimumRecovery& self, nb::handle goal, const ArrayLike& q, double potential, double period) {
            const Goal target = as_goal(goal, self.num_coordinates());
            const Eigen::VectorXd at = as_vector(q, "q", self.num_coordinates());
            const Exclusive use(&self, "the local-minimum recovery");
            return self.pursue(target, at, potential, as_period(period));
          },
          nb::arg("goal"), nb::arg("q"), nb::arg("potential"), nb::arg("period"),
          nb::sig("def pursue(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, q: numpy.typing.ArrayLike, "
                  "potential: float, period: float) -> JointGoal | PoseGoal"),
          "The goal to follow in a step of `period` [s]: the goal given, or a sub-goal. potential: `Step.goal_potential`\n"
          "of the step before, NaN where there was none; it is used for poses, not for configurations.")
      .def_prop_ro("escaping", &LocalMinimumRecovery::escaping, "Whether the last step followed a sub-goal.")
      .def_prop_ro("count", &LocalMinimumRecovery::count, "How many sub-goals there have been.");

  nb::class_<AvoidanceTrajectory>(m, "AvoidanceTrajectory",
                     "A motion from q at v (nv,) to rest at a configuration (nv,), each joint as fast as nine tenths of its\n"
                     "limits allow, and the acceleration that follows it. It ignores obstacles: the acceleration is for an\n"
                     "MotionProgram with clearances. Raises ValueError on wrong shapes and what is\n"
                     "not finite.")
      .def(
          "__init__",
          [](AvoidanceTrajectory* self, const Robot& robot, const ArrayLike& q, const ArrayLike& v, const ArrayLike& target) {
            const int nv = robot.num_coordinates();
            new (self) AvoidanceTrajectory(robot.limits(), as_finite_vector(q, "q", nv), as_finite_vector(v, "v", nv),
                              as_finite_vector(target, "target", nv));
          },
          nb::arg("robot"), nb::arg("q"), nb::arg("v"), nb::arg("target"))
      .def("__copy__", [](const AvoidanceTrajectory& self) { return AvoidanceTrajectory(self); })
      .def(
          "acceleration",
          [](const AvoidanceTrajectory& self, const ArrayLike& q, const ArrayLike& v, double period) {
            const int nv = static_cast<int>(self.target().size());
            return to_numpy(self.acceleration(as_vector(q, "q", nv), as_vector(v, "v", nv), as_period(period)));
          },
          nb::arg("q"), nb::arg("v"), nb::arg("period"),
          "a* + w^2 (q* - q) + 2 w (v* - v) (nv,) [/s^2], w = 10 /s, for a step of `period` [s].")
      .def(
          "advance", [](AvoidanceTrajectory& self, double period) { self.advance(as_period(period)); }, nb::arg("period"),
          "Moves the reference on by `period` [s].")
      .def_prop_ro(
          "target", [](const AvoidanceTrajectory& self) { return to_numpy(self.target()); }, "Where it comes to rest (nv,) [rad | m].")
      .def_prop_ro(
          "position", [](const AvoidanceTrajectory& self) { return to_numpy(self.position()); }, "The reference q* (nv,) [rad | m].")
      .def_prop_ro(
          "velocity", [](const AvoidanceTrajectory& self) { return to_numpy(self.velocity()); }, "The reference's velocity v* (nv,) [/s].");

  nb::class_<LookAhead>(m, "LookAhead",
                      "Leads an arm out of the way of what moves, in time, where a barrier would back off along the line of\n"
                      "approach until a joint limit stops the arm. A look integrates the system, as a MotionProgram lets\n"
                      "it, with the obstacles moving on as they do; where that comes nearer to them than `clearance` [m] within\n"
                      "`horizon` [s], it looks for an AvoidanceTrajectory to one of `tries` random configurations that does not,\n"
                      "to be followed until the way to the goal is free. One thread at a time. period [s]: of the steps looked\n"
                      "at, shorter where it does not go into delay whole times; delay [s]: from one look to the next, from when\n"
                      "on is followed what it found; seed: of the configurations.\n"
                      "Raises ValueError that names the setting at fault, or if the system has no clearances to obstacles.")
      .def(
          "__init__",
          [](LookAhead* self, std::shared_ptr<GeometricSystem> system, double horizon, double period, double delay,
             double clearance, int tries, std::uint64_t seed) {
            new (self) LookAhead(std::move(system), {horizon, period, delay, clearance, tries, seed});
          },
          nb::arg("system"), nb::kw_only(), nb::arg("horizon") = LookAheadSettings().horizon,
          nb::arg("period") = LookAheadSettings().period, nb::arg("delay") = LookAheadSettings().delay,
          nb::arg("clearance") = LookAheadSettings().clearance, nb::arg("tries") = LookAheadSettings().tries,
          nb::arg("seed") = LookAheadSettings().seed)
      .def(
          "look",
          [](LookAhead& self, nb::handle goal, const ArrayLike& q, const ArrayLike& v, const Obstacles& obstacles,
             const std::optional<AvoidanceTrajectory>& followed) {
            const int nv = self.num_coordinates();
            const Goal target = as_goal(goal, nv);
            const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv);
            if (followed && followed->target().size() != nv) {
              throw std::invalid_argument("the trajectory is for " + std::to_string(followed->target().size()) +
                                          " coordinates, the system has " + std::to_string(nv));
            }
            const Obstacles seen = obstacles;
            const Exclusive use(&self, "the look-ahead");
            return interruptible([&](const Interrupted& interrupted) {
              const InterruptedWhile look(&self, interrupted);
              return self.update(target, position, velocity, seen, followed);
            });
          },
          nb::arg("goal"), nb::arg("q"), nb::arg("v"), nb::arg("obstacles"), nb::arg("followed") = nb::none(),
          nb::sig("def look(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, q: numpy.typing.ArrayLike, "
                  "v: numpy.typing.ArrayLike, obstacles: Obstacles, followed: AvoidanceTrajectory | None = None) -> AvoidanceTrajectory | None"),
          "What to follow from `delay` on: a trajectory, or None for the system and the goal. q, v (nv,), obstacles and the\n"
          "trajectory that is followed, if there is one, are of now. Takes as long as some thousand steps, so not for the\n"
          "thread of a loop; other threads run meanwhile. The trajectory is advanced by who follows it.")
      .def(
          "pursue",
          [](LookAhead& self, nb::handle goal, const ArrayLike& q, const ArrayLike& v, const Obstacles& obstacles,
             double period) {
            const int nv = self.num_coordinates();
            const Goal target = as_goal(goal, nv);
            const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv);
            const Exclusive use(&self, "the look-ahead");
            const HeldObstacles held(obstacles);
            return interruptible([&](const Interrupted& interrupted) {
              const InterruptedWhile look(&self, interrupted);
              const AvoidanceTrajectory* flight = self.pursue(target, position, velocity, held, as_period(period));
              return flight == nullptr ? std::nullopt : std::optional<AvoidanceTrajectory>(*flight);
            });
          },
          nb::arg("goal"), nb::arg("q"), nb::arg("v"), nb::arg("obstacles"), nb::arg("period"),
          nb::sig("def pursue(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal, q: numpy.typing.ArrayLike, "
                  "v: numpy.typing.ArrayLike, obstacles: Obstacles, period: float) -> AvoidanceTrajectory | None"),
          "The trajectory to follow in a step of `period` [s] of a simulation, None where the goal is followed: looks every\n"
          "`delay`, and follows what the look before found, as if another thread had looked meanwhile.")
      .def("reset",
           [](LookAhead& self) {
             const Exclusive use(&self, "the look-ahead");
             self.reset();
           },
           "Before another motion is pursued: what was found is forgotten.")
      .def_prop_ro("count", &LookAhead::count, "How many trajectories were found.");
}

}  // namespace sidestep::python
