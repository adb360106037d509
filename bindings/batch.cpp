#include "sidestep/thesis/rollout_batch.hpp"

#include "sidestep/controller/motion.hpp"

#include <nanobind/stl/vector.h>

#include "system.hpp"
#include "interruptible.hpp"
#include "module.hpp"

namespace sidestep::python {
namespace {

Eigen::MatrixXd as_rows(nb::handle value, const char* name, Eigen::Index nv) {
  const Array array = as_array(value, name);
  if (array.ndim() != 2 || static_cast<Eigen::Index>(array.shape(1)) != nv) {
    throw nb::value_error((std::string(name) + " must have shape (N, " + std::to_string(nv) + ")").c_str());
  }
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      array.data(), static_cast<Eigen::Index>(array.shape(0)), nv);
}

}  // namespace

void bind_batch(nb::module_& m) {
  m.def(
      "integrate_batch",
      [](nb::handle controllers, const ArrayLike& q, const ArrayLike& v, int steps, nb::handle goals, double tolerance,
         int threads) {
        const nb::tuple kept(nb::borrow(controllers));  // that no other thread takes one away meanwhile
        std::vector<Controller*> all;
        for (const nb::handle controller : kept) {
          all.push_back(&nb::cast<Controller&>(controller));
        }
        if (all.empty()) {
          return std::vector<MotionRecord>();
        }
        const int nv = all.front()->arm().num_coordinates();
        const Eigen::MatrixXd positions = as_rows(q, "q", nv), velocities = as_rows(v, "v", nv),
                              ends = goals.is_none() ? Eigen::MatrixXd() : as_rows(goals, "goals", nv);
        return interruptible([&](const Interrupted& interrupted) {
          return integrate_batch(all, positions, velocities, steps, ends, tolerance, threads, interrupted);
        });
      },
      nb::arg("controllers"), nb::arg("q"), nb::arg("v"), nb::kw_only(), nb::arg("steps"), nb::arg("goals") = nb::none(),
      nb::arg("tolerance") = 0.0, nb::arg("threads") = 0,
      nb::sig("def integrate_batch(controllers: Sequence[Controller], q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, "
              "steps: int, goals: numpy.typing.ArrayLike | None = None, tolerance: float = 0.0, threads: int = 0) "
              "-> list[MotionRecord]"),
      "The motions of N controllers from q, v (N, nv), row k of controller k, each as `integrate` gives it, bit for bit, on\n"
      "several threads (0: one per processor). Each ends when every joint is within tolerance [rad | m] of its row of goals\n"
      "(N, nv), if given. Releases the GIL. Raises ValueError as `integrate` does, on a controller that is there twice and records\n"
      "of more than 8 GiB, RuntimeError while a controller is in use.");
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

}  // namespace sidestep::python
