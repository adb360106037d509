#include "sidestep/controller/recorded_run.hpp"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "interruptible.hpp"
#include "module.hpp"
#include "os_errors.hpp"

namespace sidestep::python {
namespace {

/// The numbers of a run as an array that is read only and keeps the run.
template <class Number, class Stored>
nb::object view_of(nb::handle owner, const std::vector<Stored>& values, std::vector<std::size_t> shape) {
  static_assert(sizeof(Number) == sizeof(Stored));
  return nb::cast(nb::ndarray<nb::numpy, const Number>(reinterpret_cast<const Number*>(values.data()), shape.size(), shape.data(),
                                                       owner));
}

using RunClass = nb::class_<RecordedRun>;
const char* const matrix_signature = "(self) -> numpy.typing.NDArray[numpy.float64]";

void add_matrix(RunClass& run, const char* name, const std::vector<double> RecordedRun::*values, const char* words) {
  run.def_prop_ro(
      name,
      [values](nb::handle self) {
        const auto& run = nb::cast<const RecordedRun&>(self);
        return view_of<double>(self, run.*values, {run.steps, run.nv});
      },
      nb::sig((std::string("def ") + name + matrix_signature).c_str()), words);
}

void add_vector(RunClass& run, const char* name, const std::vector<double> RecordedRun::*values, const char* words) {
  run.def_prop_ro(
      name,
      [values](nb::handle self) {
        const auto& run = nb::cast<const RecordedRun&>(self);
        return view_of<double>(self, run.*values, {(run.*values).size()});
      },
      nb::sig((std::string("def ") + name + matrix_signature).c_str()), words);
}

template <class Number, class Stored>
void add_numbers(RunClass& run, const char* name, const std::vector<Stored> RecordedRun::*values, const char* type, const char* words) {
  run.def_prop_ro(
      name,
      [values](nb::handle self) {
        const auto& run = nb::cast<const RecordedRun&>(self);
        return view_of<Number>(self, run.*values, {(run.*values).size()});
      },
      nb::sig((std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy." + type + "]").c_str()), words);
}

}  // namespace

void bind_recorded_run(nb::module_& m) {
  RunClass run(m, "RecordedRun", "A recorded run as arrays; row k is step k.");
  run.def_ro("header", &RecordedRun::header, "What made the recording, and with what.")
      .def_ro("complete", &RecordedRun::complete, "The recording was ended, not cut off by the end of its program.")
      .def_ro("lost", &RecordedRun::lost, "Steps that were made and not recorded.")
      .def_ro("damage", &RecordedRun::damage, "What is wrong with a file, and where; empty: nothing.")
      .def_ro("steps", &RecordedRun::steps, "Number of steps.");
  add_vector(run, "time", &RecordedRun::time, "(steps,) on the clock of `step` [s].");
  add_matrix(run, "q", &RecordedRun::q, "(steps, nv) measured [rad | m].");
  add_matrix(run, "v", &RecordedRun::v, "(steps, nv) measured [rad/s | m/s].");
  add_matrix(run, "position", &RecordedRun::position, "(steps, nv) commanded [rad | m].");
  add_matrix(run, "velocity", &RecordedRun::velocity, "(steps, nv) commanded [rad/s | m/s].");
  add_matrix(run, "acceleration", &RecordedRun::acceleration, "(steps, nv) commanded [rad/s² | m/s²].");
  add_matrix(run, "wanted", &RecordedRun::wanted, "(steps, nv) acceleration before any limit [rad/s² | m/s²].");
  add_matrix(run, "torque", &RecordedRun::torque, "(steps, nv) commanded, gravity included [Nm | N].");
  add_matrix(run, "torque_without_gravity", &RecordedRun::torque_without_gravity, "(steps, nv) commanded [Nm | N].");
  add_vector(run, "clearance", &RecordedRun::clearance, "(steps,) least of the covering body [m]; inf: far, nan: unknown.");
  add_vector(run, "distance", &RecordedRun::distance, "(steps,) to the nearest obstacle, with speed limits [m].");
  add_vector(run, "speed", &RecordedRun::speed, "(steps,) of the fastest frame [m/s].");
  add_vector(run, "speed_limit", &RecordedRun::speed_limit, "(steps,) for every frame [m/s].");
  add_vector(run, "tracking_error", &RecordedRun::tracking_error, "(steps,) largest of the joints [rad | m].");
  add_numbers<std::int32_t>(run, "status", &RecordedRun::status, "int32", "(steps,) numbers of SafetyStatus.");
  add_numbers<std::int32_t>(run, "activity", &RecordedRun::activity, "int32", "(steps,) numbers of Activity.");
  add_numbers<std::int32_t>(run, "nearest", &RecordedRun::nearest, "int32", "(steps,) index in `parties` of the least clearance; -1: nothing is near.");
  add_numbers<std::int32_t>(run, "bound_by", &RecordedRun::bound_by, "int32", "(steps,) index in `parties` of what changes the motion most; -1: nothing.");
  add_numbers<std::int32_t>(run, "request", &RecordedRun::request, "int32", "(steps,) index in `requests`; -1: none is known.");
  add_vector(run, "link_time", &RecordedRun::link_time, "(moments,) of `link_clearance` [s].");
  run.def_prop_ro("limits",
                  [](nb::handle self) {
                    const auto& run = nb::cast<const RecordedRun&>(self);
                    return view_of<std::uint16_t>(self, run.limits, {run.steps, run.nv});
                  },
                  nb::sig("def limits(self) -> numpy.typing.NDArray[numpy.uint16]"),
                  "(steps, nv) limits that restrict each joint, as bits.")
      .def_prop_ro("link_clearance",
                   [](nb::handle self) {
                     const auto& run = nb::cast<const RecordedRun&>(self);
                     return view_of<double>(self, run.link_clearance, {run.link_time.size(), run.links.size()});
                   },
                   nb::sig("def link_clearance(self) -> numpy.typing.NDArray[numpy.float64]"),
                   "(moments, links) of each link to what is around [m], and of the arm to itself (the last); inf: farther than 0.5 m.\n"
                   "Computed by the clearance query from the recorded q and obstacles.")
      .def(
          "scene",
          [](nb::handle self, std::size_t moment) {
            const auto& run = nb::cast<const RecordedRun&>(self);
            if (moment >= run.scenes.size()) {
              throw nb::index_error("no such moment, or the run was read without scenes");
            }
            const RecordedRun::Scene& scene = *run.scenes[moment];
            const auto count = static_cast<std::size_t>(scene.radii.size());
            const std::size_t points[] = {count, 3}, radii[] = {count};
            return nb::make_tuple(nb::ndarray<nb::numpy, const float>(scene.points.data(), 2, points, self),
                                  nb::ndarray<nb::numpy, const float>(scene.radii.data(), 1, radii, self));
          },
          nb::arg("moment"),
          nb::sig("def scene(self, moment: int) -> tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32]]"),
          "Centres (N, 3) [m] and radii (N,) [m] of the obstacles at a moment of link_time, if they were read.")
      .def_ro("links", &RecordedRun::links, "Names of the links, and \"the arm itself\".")
      .def_ro("requests", &RecordedRun::requests, "What was asked, in words, in the order of use.")
      .def_prop_ro("parties",
                   [](const RecordedRun& run) {
                     nb::list list;
                     for (const auto& one : run.parties) {
                       list.append(nb::make_tuple(one.link, one.words));
                     }
                     return list;
                   },
                   nb::sig("def parties(self) -> list[tuple[str, str]]"), "A link, and what it is near to in words.")
      .def(
          "explain",
          [](const RecordedRun& run, std::size_t k) {
            if (k >= run.steps) {
              throw nb::index_error("no such step");
            }
            return run.explain(k);
          },
          nb::arg("step"), nb::sig("def explain(self, step: int) -> str"),
          "One sentence from what was recorded: how safe a step (from 0) was, and why.")
      .def("__repr__", [](const RecordedRun& run) {
        return "RecordedRun(arm '" + run.header.arm.name() + "', " + std::to_string(run.steps) + " steps)";
      });
  m.def(
      "read_recorded_run",
      [](const std::vector<std::filesystem::path>& paths, bool scenes) {
        return with_os_errors(paths.empty() ? std::filesystem::path() : paths.front(), [&] {
          return interruptible([&](const Interrupted& interrupted) { return read_recorded_run(paths, scenes, interrupted); });
        });
      },
      nb::arg("paths"), nb::kw_only(), nb::arg("scenes") = false,
      nb::sig("def read_recorded_run(paths: Sequence[str | os.PathLike[str]], *, scenes: bool = False) -> RecordedRun"),
      "Reads a recording, or the files of one black box in the order of time; with `scenes` also where the obstacles were. Raises\n"
      "OSError where one cannot be read, ValueError that says what is wrong with it.");
}

}  // namespace sidestep::python
