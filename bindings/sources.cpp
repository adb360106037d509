// What a controller is told of obstacles, source by source.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>

#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/controller/controller.hpp"

namespace sidestep::python {
namespace {

/// Seconds or None, which is NaN; NaN itself is refused: in a set it is a fault.
double told_seconds(nb::handle value, const char* name) {
  const double number = as_seconds(value, name);
  if (std::isnan(number) && !value.is_none()) {
    throw nb::value_error((std::string(name) + " is nan, must be a number of seconds, or None where it is not known").c_str());
  }
  return number;
}

SourceOptions options(nb::handle source, nb::handle time, nb::handle valid_for) {
  return {as_text(source, "source", "the name of a source, such as 'camera'"), told_seconds(time, "time"),
          told_seconds(valid_for, "valid_for")};
}

void warn_of_obstacles(const Controller& controller) {
  if (const std::string question = controller.questions().obstacles; !question.empty()) {
    warn(question);
  }
}

}  // namespace

void bind_sources(nb::module_& m) {
  nb::class_<SourceState>(m, "SourceState", "What a controller believes of a source of obstacles.")
      .def_ro("name", &SourceState::name, "As `set_obstacles` was told.")
      .def_ro("size", &SourceState::size, "Number of points.")
      .def_ro("age", &SourceState::age, "Time since what is believed was captured [s]; inf: it was expected, and has not come yet.")
      .def_ro("valid_for", &SourceState::valid_for, "Age up to which it is believed [s]; inf: for ever.")
      .def_ro("is_overdue", &SourceState::is_overdue, "It is older than that: the arm stops until it comes again.")
      .def_ro("is_emptied", &SourceState::is_emptied, "Newer sets are empty, and not believed yet.")
      .def("__repr__", [](const SourceState& s) {
        return "SourceState('" + s.name + "', size=" + std::to_string(s.size) + ", age=" + std::to_string(s.age) +
               ", valid_for=" + std::to_string(s.valid_for) + (s.is_overdue ? ", overdue" : "") + (s.is_emptied ? ", emptied" : "") + ")";
      });

  auto c = nb::borrow<nb::class_<Controller>>(m.attr("Controller"));
  c.def(
       "set_obstacles",
       [](Controller& self, nb::handle obstacles, nb::handle source, nb::handle time, nb::handle valid_for) {
         const SourceOptions told = options(source, time, valid_for);
         self.set_obstacles(as_obstacles(obstacles), told);
         warn_of_obstacles(self);
       },
       nb::arg("obstacles").none(), nb::arg("source") = SourceOptions::scene, nb::kw_only(), nb::arg("time") = nb::none(),
       nb::arg("valid_for") = nb::none(),
       nb::sig("def set_obstacles(self, obstacles: Obstacles | sidestep.obstacles.Shape | "
               "collections.abc.Sequence[Obstacles | sidestep.obstacles.Shape], source: str = 'scene', *, "
               "time: float | None = None, valid_for: float | None = None) -> None"),
       "Replaces what a source said before, and nothing of the others, from the next step on: points, a shape, or a list of both. Balls\n"
       "cover each shape without gaps, see `sidestep.obstacles.obstacles_from_shapes`. Points move on by their velocities, from `time`\n"
       "on: when they were captured [s], on the clock of `step`; None: when the next step takes them.\n"
       "\n"
       "valid_for [s]: age up to which they are believed; inf: for ever. None: `sources.valid_for` where they have a time or velocities, or\n"
       "where the source came three times within that; else for ever (`obstacle_timeout`). A source that is older is overdue: its points\n"
       "stand still, the arm stops, and goes on when it comes again. An empty set after one with points is believed once the source\n"
       "has stayed empty for `sources.empty_after`; `remove_obstacles` at once. Until anything was set the arm stays where it is:\n"
       "`Obstacles.none()` says that the space is free. Raises ValueError that names the value and what is allowed.")
      .def(
          "expect_obstacles", [](Controller& self, nb::handle source) { self.expect_obstacles(as_text(source, "source", "the name of a source")); },
          nb::arg("source"), nb::sig("def expect_obstacles(self, source: str) -> None"),
          "Tells that a source will come: the arm stays where it is until it has said something, as a second camera that starts later. A\n"
          "source that has, stays as it is. `Perception` expects each of its cameras. Raises ValueError that names the value.")
      .def(
          "remove_obstacles", [](Controller& self, nb::handle source) { self.remove_obstacles(as_text(source, "source", "the name of a source")); },
          nb::arg("source") = SourceOptions::scene, nb::sig("def remove_obstacles(self, source: str = 'scene') -> None"),
          "Forgets a source, at once; also one that was expected. Raises ValueError that lists the sources.")
      .def(
          "add_obstacle",
          [](Controller& self, nb::handle obstacle, nb::handle source) {
            self.add_obstacle(as_obstacles(obstacle), as_text(source, "source", "the name of a source"));
            warn_of_obstacles(self);
          },
          nb::arg("obstacle").none(), nb::arg("source") = SourceOptions::scene,
          nb::sig("def add_obstacle(self, obstacle: Obstacles | sidestep.obstacles.Shape, source: str = 'scene') -> None"),
          "Adds a shape with a name to what a source says. Raises ValueError where it has no name, or the source has that name already.")
      .def(
          "move_obstacle",
          [](Controller& self, nb::handle name, nb::handle pose, nb::handle source, nb::handle time, nb::handle valid_for) {
            self.move_obstacle(as_text(name, "name", "the name of an obstacle"), as_pose(pose), options(source, time, valid_for));
          },
          nb::arg("name"), nb::arg("pose"), nb::arg("source") = SourceOptions::scene, nb::kw_only(), nb::arg("time") = nb::none(),
          nb::arg("valid_for") = nb::none(),
          nb::sig("def move_obstacle(self, name: str, pose: numpy.typing.ArrayLike, source: str = 'scene', *, time: float | None = None, "
                  "valid_for: float | None = None) -> None"),
          "Moves a shape that has a name to another pose (4, 4) in the world. Like `set_obstacles` it says that the whole source is as\n"
          "new as `time`: give each tracker a source of its own. Raises ValueError that lists the names.")
      .def(
          "remove_obstacle",
          [](Controller& self, nb::handle name, nb::handle source) {
            self.remove_obstacle(as_text(name, "name", "the name of an obstacle"), as_text(source, "source", "the name of a source"));
          },
          nb::arg("name"), nb::arg("source") = SourceOptions::scene,
          nb::sig("def remove_obstacle(self, name: str, source: str = 'scene') -> None"),
          "Removes a shape that has a name from what a source says, at once. Raises ValueError that lists the names.")
      .def_prop_ro("time", &Controller::time, "Time of the last step [s], on the clock on which obstacles are captured.")
      .def_prop_ro("sources",
                   [](const Controller& self) { return self.sources(); },
                   "What is believed of each source, a SourceState each, as of the last step. For the thread of `step`.");
}

}  // namespace sidestep::python
