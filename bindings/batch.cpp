#include "sidestep/controller/motion.hpp"

#include <nanobind/stl/vector.h>

#include "system.hpp"
#include "interruptible.hpp"
#include "module.hpp"

namespace sidestep::python {

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
}

}  // namespace sidestep::python
