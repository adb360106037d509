#include "sidestep/dynamical_system/batch.hpp"

#include <nanobind/stl/vector.h>

#include "dynamical_system.hpp"
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
