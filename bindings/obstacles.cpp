#include "sidestep/scene/obstacles.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "module.hpp"

namespace sidestep::python {
namespace {

constexpr std::size_t most_names = 4;  // Most names that a message lists.
constexpr double far = 100.0;  // Distance beyond which all points together cause a warning [m].

/// Warns where no point is near, as of points in millimetres. The first that is near ends the search. Cameras may mark what they
/// do not see by the largest number.
void warn_of_far(const Obstacles& obstacles) {
  const Eigen::Matrix3Xd& p = obstacles.points();
  Eigen::Index nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    const double distance = p.col(i).cwiseAbs().maxCoeff() - obstacles.radii()[i];
    if (distance <= far) {
      return;
    }
    if (distance < least) {
      nearest = i;
      least = distance;
    }
  }
  warn("obstacles: all points are farther than " + in_short(far) + " m, the nearest is at " + in_short(p.col(nearest)) +
       " m; are they in millimetres? They must be in metres");
}

/// For example "Obstacles(1012 points, of 'table', 'cup')".
std::string in_words(const Obstacles& obstacles) {
  std::string names;
  std::size_t num = 0;
  for (const auto& [name, count] : obstacles.groups()) {
    if (!name.empty() && ++num <= most_names) {
      names += (names.empty() ? ", of '" : ", '") + std::string(name) + "'";
    }
  }
  if (num > most_names) {
    names += " and " + std::to_string(num - most_names) + " more";
  }
  return "Obstacles(" + std::to_string(obstacles.size()) + (obstacles.size() == 1 ? " point" : " points") + names + ")";
}

}  // namespace

void bind_obstacles(nb::module_& m) {
  m.def(
      "real_array", [](nb::handle value, const std::string& name) { return real_array(value, name.c_str()); },
      nb::arg("value").none(), nb::arg("name"),
      nb::sig("def real_array(value: numpy.typing.ArrayLike, name: str) -> numpy.typing.NDArray[numpy.float64]"),
      "`value` as an array of float64, not copied where it is one. Raises TypeError that names the argument and its dtype for\n"
      "complex numbers, booleans, dates, text and objects, ValueError for masked entries.");

  nb::class_<Obstacles>(m, "Obstacles",
                        "Obstacle points in the world, each a ball with a radius, moving with a constant velocity.")
      .def(
          "__init__",
          [](Obstacles* self, nb::handle points, nb::handle radii, nb::handle velocities) {
            Eigen::Matrix3Xd p = as_points(points, "points");
            Eigen::VectorXd r = as_filled_vector(radii, "radii", p.cols());
            Eigen::Matrix3Xd s = velocities.is_none() ? Eigen::Matrix3Xd(Eigen::Matrix3Xd::Zero(3, p.cols()))
                                                      : as_points(velocities, "velocities");
            Obstacles made(std::move(p), std::move(r), std::move(s));
            warn_of_far(made);
            new (self) Obstacles(std::move(made));
          },
          nb::arg("points").none(), nb::arg("radii").none() = 0.0, nb::arg("velocities") = nb::none(),
          nb::sig("def __init__(self, points: numpy.typing.ArrayLike, radii: numpy.typing.ArrayLike = 0.0, "
                  "velocities: numpy.typing.ArrayLike | None = None) -> None"),
          "points (N, 3) [m]; radii scalar or (N,) [m], >= 0; velocities (N, 3) [m/s] or None for rest.\n"
          "Radii are at most 1e9 m. Raises ValueError that names the first bad point; an empty cloud is refused (see none()).\n"
          "Warns where every point is farther than 100 m, as points in millimetres are.")
      .def_static("none", &Obstacles::none, "A workspace that is known to be free.")
      .def("__getstate__",
           [](const Obstacles& o) {
             nb::list names, counts;
             for (const auto& [name, count] : o.groups()) {
               names.append(std::string(name));
               counts.append(count);
             }
             return nb::make_tuple(to_numpy_points(o.points()), to_numpy(o.radii()), to_numpy_points(o.velocities()), names, counts);
           },
           nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def("__setstate__",
           [](Obstacles& self, const nb::tuple& state) {
             Eigen::Matrix3Xd points = as_points(state[0], "points");
             if (points.cols() == 0) {
               new (&self) Obstacles(Obstacles::none());
               return;
             }
             Obstacles made(std::move(points), as_vector(state[1], "radii"), as_points(state[2], "velocities"));
             new (&self) Obstacles(made.named(nb::cast<std::vector<std::string>>(state[3]), nb::cast<std::vector<Eigen::Index>>(state[4])));
           },
           nb::sig("def __setstate__(self, state: tuple[typing.Any, ...], /) -> None"))
      .def("__copy__", [](const Obstacles& o) { return Obstacles(o); })
      .def("__eq__",
           [](const Obstacles& o, nb::handle other) {
             if (!nb::isinstance<Obstacles>(other)) {
               return false;
             }
             const auto& p = nb::cast<const Obstacles&>(other);
             return o.size() == p.size() && o.points() == p.points() && o.radii() == p.radii() && o.velocities() == p.velocities() &&
                    o.groups() == p.groups();
           },
           nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__hash__", [](const Obstacles&) -> Py_hash_t { throw nb::type_error("unhashable type: 'Obstacles', which move"); })
      .def("__len__", &Obstacles::size)
      .def("__repr__", [](const Obstacles& o) { return in_words(o); })
      .def_prop_ro("points", [](const Obstacles& o) { return to_numpy_points(o.points()); })
      .def_prop_ro("radii", [](const Obstacles& o) { return to_numpy(o.radii()); }, "(N,) [m].")
      .def_prop_ro("velocities", [](const Obstacles& o) { return to_numpy_points(o.velocities()); }, "(N, 3) [m/s] in the world.")
      .def_prop_ro("groups",
                   [](const Obstacles& o) {
                     std::vector<std::pair<std::optional<std::string>, Eigen::Index>> groups;
                     for (const auto& [name, count] : o.groups()) {
                       groups.emplace_back(name.empty() ? std::optional<std::string>() : std::optional(name), count);
                     }
                     return groups;
                   },
                   "Of what belongs together, in the order of the points: its name, None where it has none, and how many.")
      .def(
          "named",
          [](const Obstacles& o, std::vector<std::string> names, const std::vector<Eigen::Index>& counts, nb::handle poses) {
            std::vector<Eigen::Isometry3d> placed;
            if (!poses.is_none()) {
              for (const nb::handle pose : nb::cast<nb::list>(poses)) {
                placed.push_back(as_pose(pose));
              }
            }
            return o.named(std::move(names), counts, std::move(placed));
          },
          nb::arg("names"), nb::arg("counts"), nb::arg("poses") = nb::none(),
          nb::sig("def named(self, names: collections.abc.Sequence[str], counts: collections.abc.Sequence[int], "
                  "poses: list[numpy.typing.NDArray[numpy.float64]] | None = None) -> Obstacles"),
           "The same points with the names of what they belong to: the first counts[0] points to names[0], and so on;\n"
           "an empty name is none. poses: (4, 4) of each in the world, by which Controller.move_obstacle moves it. Raises ValueError unless counts and names are as many, and the counts add up to the number of points.")
      .def(
          "name_of",
          [](const Obstacles& o, Eigen::Index point) {
            if (point < 0 || point >= o.size()) {
              throw nb::index_error(("point is " + std::to_string(point) + ", there are " + std::to_string(o.size()) +
                                     " points").c_str());
            }
            const std::string_view name = o.name_of(point);
            return name.empty() ? std::optional<std::string>() : std::optional<std::string>(name);
          },
          nb::arg("point"),
          "Name of what a point belongs to, as messages call it; None where it has none. Raises IndexError.")
      .def(
          "advance",
          [](Obstacles& self, double duration) {
            if (!self.advance(duration)) {
              throw nb::value_error(("duration is " + std::to_string(duration) +
                                     " s, must be finite, as must be where it takes the points")
                                        .c_str());
            }
          },
          nb::arg("duration"),
          "Moves every point along its velocity for `duration` [s]. Raises ValueError, and moves none, where it, or\n"
          "where it takes a point, is not finite.");
}

Obstacles as_obstacles(nb::handle value) {
  if (nb::isinstance<Obstacles>(value)) {
    return nb::cast<Obstacles>(value);
  }
  return nb::cast<Obstacles>(nb::module_::import_("sidestep.obstacles").attr("obstacles_from_shapes")(value));
}

}  // namespace sidestep::python
