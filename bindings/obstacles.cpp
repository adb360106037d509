#include "sidestep/obstacles/obstacles.hpp"

#include "arguments.hpp"
#include "module.hpp"

namespace sidestep::python {

void bind_obstacles(nb::module_& m) {
  nb::class_<Obstacles>(m, "Obstacles",
                        "Obstacle points in the world, each a ball with a radius, moving with a constant velocity.")
      .def(
          "__init__",
          [](Obstacles* self, const ArrayLike& points, const ArrayLike& radii, const ArrayLike& velocities) {
            Eigen::Matrix3Xd p = as_points(points, "points");
            Eigen::VectorXd r = as_filled_vector(radii, "radii", p.cols());
            Eigen::Matrix3Xd s = velocities.is_none() ? Eigen::Matrix3Xd(Eigen::Matrix3Xd::Zero(3, p.cols()))
                                                      : as_points(velocities, "velocities");
            new (self) Obstacles(std::move(p), std::move(r), std::move(s));
          },
          nb::arg("points"), nb::arg("radii") = 0.0, nb::arg("velocities").none() = nb::none(),
          "points (N, 3) [m]; radii scalar or (N,) [m], >= 0; velocities (N, 3) [m/s] or None for rest.\n"
          "Raises ValueError that names the first bad point; an empty cloud is refused (see none()).")
      .def_static("none", &Obstacles::none, "A workspace that is known to be free.")
      .def("__len__", &Obstacles::size)
      .def_prop_ro("points", [](const Obstacles& o) { return to_numpy_points(o.points()); })
      .def_prop_ro("radii", [](const Obstacles& o) { return to_numpy(o.radii()); })
      .def_prop_ro("velocities", [](const Obstacles& o) { return to_numpy_points(o.velocities()); })
      .def("advance", &Obstacles::advance, nb::arg("duration"),
           "Moves every point along its velocity for `duration` [s].");
}

}  // namespace sidestep::python
