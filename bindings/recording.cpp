#include "sidestep/controller/recording.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "os_errors.hpp"
#include "recording.hpp"

namespace sidestep::python {

RecordingSummary RecordingInProgress::stop() {
  if (!summary) {
    with_os_errors(path, [&] {
      const nb::gil_scoped_release others;
      summary = controller->stop_recording();
    });
    if (summary->lost > 0) {
      warn("recording '" + path.string() + "': the disk was too slow, so that " + std::to_string(summary->lost) +
           " steps after step " + std::to_string(summary->steps) + " are lost");
    }
  }
  return *summary;
}

BlackBoxSummary BlackBoxInProgress::stop() {
  if (!summary) {
    with_os_errors(folder, [&] {
      const nb::gil_scoped_release others;
      summary = controller->stop_black_box();
    });
    if (!summary->trouble.empty()) {
      warn("black box in '" + folder.string() + "': " + summary->trouble + ", so that " + std::to_string(summary->lost) +
           " steps after step " + std::to_string(summary->steps) + " are lost");
    }
  }
  return *summary;
}

namespace {

void bind_black_box(nb::module_& m) {
  nb::class_<BlackBoxSummary>(m, "BlackBoxSummary", "What a black box has kept.")
      .def_ro("files", &BlackBoxSummary::files, "In the order of time; `load_recording(files)` reads them. Older ones are deleted.")
      .def_ro("steps", &BlackBoxSummary::steps, "Steps that it recorded, those in deleted files included.")
      .def_ro("lost", &BlackBoxSummary::lost, "Steps made after those, when the disk was too slow or full.")
      .def_ro("bytes", &BlackBoxSummary::bytes, "Size of the files.")
      .def_ro("trouble", &BlackBoxSummary::trouble, "Why nothing was written any more; empty: nothing.")
      .def("__repr__", [](const BlackBoxSummary& s) {
        return "BlackBoxSummary(" + std::to_string(s.files.size()) + " files, " + std::to_string(s.bytes) + " bytes, " +
               std::to_string(s.lost) + " steps lost)";
      });
  nb::class_<BlackBoxInProgress>(m, "BlackBox", "The last seconds of a controller on disk; as a context manager it ends with the block.")
      .def("stop", &BlackBoxInProgress::stop, "Ends it; the files stay. Returns its BlackBoxSummary; warns of lost steps.")
      .def("__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> BlackBox"))
      .def(
          "__exit__", [](BlackBoxInProgress& self, nb::handle, nb::handle, nb::handle) { static_cast<void>(self.stop()); },
          nb::arg("type").none(), nb::arg("value").none(), nb::arg("traceback").none(),
          nb::sig("def __exit__(self, type: typing.Any, value: typing.Any, traceback: typing.Any) -> None"))
      .def("__repr__", [](const BlackBoxInProgress& self) { return "BlackBox('" + self.folder.string() + "')"; });
}

}  // namespace

void bind_recording(nb::module_& m) {
  bind_black_box(m);
  m.attr("recording_suffix") = nb::str(recording_suffix.data(), recording_suffix.size());
  m.attr("black_box_begin") = nb::str(black_box_begin.data(), black_box_begin.size());
  nb::class_<RecordingSummary>(m, "RecordingSummary", "What a recording holds.")
      .def_ro("path", &RecordingSummary::path, "Its file.")
      .def_ro("steps", &RecordingSummary::steps, "Steps that it holds.")
      .def_ro("lost", &RecordingSummary::lost, "Steps made after those, when the disk was too slow.")
      .def_ro("bytes", &RecordingSummary::bytes, "Size of the file.")
      .def("__repr__", [](const RecordingSummary& s) {
        return "RecordingSummary(" + std::to_string(s.steps) + " steps, " + std::to_string(s.lost) + " lost, " +
               std::to_string(s.bytes) + " bytes)";
      });
  nb::class_<RecordingInProgress>(m, "Recording",
                                  "A recording of a controller's steps; as a context manager it ends with the block.")
      .def("stop", &RecordingInProgress::stop,
           "Ends it. Returns its RecordingSummary; warns of lost steps. Raises OSError where writing failed.")
      .def("__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> Recording"))
      .def(
          "__exit__", [](RecordingInProgress& self, nb::handle, nb::handle, nb::handle) { static_cast<void>(self.stop()); },
          nb::arg("type").none(), nb::arg("value").none(), nb::arg("traceback").none(),
          nb::sig("def __exit__(self, type: typing.Any, value: typing.Any, traceback: typing.Any) -> None"))
      .def("__repr__", [](const RecordingInProgress& self) { return "Recording('" + self.path.string() + "')"; });
  nb::class_<RecordingHeader>(m, "RecordingHeader", "What made a recording, and with what.")
      .def_ro("format", &RecordingHeader::format, "Version of the file's format.")
      .def_ro("sidestep_version", &RecordingHeader::sidestep_version, "The version of Sidestep that wrote it.")
      .def_ro("compiler", &RecordingHeader::compiler, "The compiler of that Sidestep.")
      .def_ro("instruction_set", &RecordingHeader::instruction_set, "Of the inner loops, see `instruction_set`.")
      .def_ro("whole", &RecordingHeader::whole, "From the first step on, so that it can be replayed; else of a black box.")
      .def_ro("arm", &RecordingHeader::arm, "The arm (of the core) of the first step.")
      .def_prop_ro("settings", [](const RecordingHeader& h) { return ControllerSettings(h.settings); }, "A copy.")
      .def_ro("notes", &RecordingHeader::notes, "What this Sidestep does not know of it, or it not of this Sidestep.")
      .def("__repr__", [](const RecordingHeader& h) {
        return "RecordingHeader(arm '" + h.arm.name() + "', Sidestep " + h.sidestep_version + ")";
      });
  nb::class_<ReplayDifference>(m, "ReplayDifference", "The first field of a command that a replay gave differently.")
      .def_ro("step", &ReplayDifference::step, "From 1.")
      .def_ro("field", &ReplayDifference::field, "For example \"torque[3]\".")
      .def_ro("recorded", &ReplayDifference::recorded, "Its value, with 17 digits.")
      .def_ro("replayed", &ReplayDifference::replayed, "Its value, with 17 digits.")
      .def("__repr__", [](const ReplayDifference& d) {
        return "ReplayDifference(step " + std::to_string(d.step) + ", " + d.field + ": recorded " + d.recorded + ", replayed " +
               d.replayed + ")";
      });
  nb::class_<ReplayResult>(m, "ReplayResult", "What a replay found.")
      .def_ro("arm", &ReplayResult::arm, "Name of the recorded arm.")
      .def_ro("steps", &ReplayResult::steps, "Steps replayed, the one that differs included.")
      .def_ro("seconds", &ReplayResult::seconds, "The same in time of the motion [s].")
      .def_prop_ro("equal", &ReplayResult::equal,
                   "Every recorded command is the same bit for bit (nan like nan), and the file is not damaged.")
      .def_ro("difference", &ReplayResult::difference, "The first; the replay ends there.")
      .def_ro("damage", &ReplayResult::damage, "What is wrong with the file, and where; empty: nothing.")
      .def_ro("complete", &ReplayResult::complete, "The recording was ended, not cut off by the end of its program.")
      .def_ro("lost", &ReplayResult::lost, "Steps that were made and not recorded.")
      .def_ro("notes", &ReplayResult::notes, "What differs between recording and replay beside the commands.")
      .def("__repr__", [](const ReplayResult& r) {
        return "ReplayResult(" + std::to_string(r.steps) + " steps, " + (r.equal() ? "equal" : "not equal") + ")";
      });
  m.def(
      "read_recording_header",
      [](const std::filesystem::path& path) { return with_os_errors(path, [&] { return read_recording_header(path); }); },
      nb::arg("path"), nb::sig("def read_recording_header(path: str | os.PathLike[str]) -> RecordingHeader"), "What made a recording. Raises OSError where it cannot be read, ValueError that says what is wrong with it.");
  m.def(
      "replay",
      [](const std::filesystem::path& path, const std::optional<Arm>& arm, const std::optional<ControllerSettings>& settings) {
        return with_os_errors(path, [&] {
          return interruptible([&](const Interrupted& interrupted) { return replay(path, arm, settings, interrupted); });
        });
      },
      nb::arg("path"), nb::kw_only(), nb::arg("arm") = nb::none(), nb::arg("settings") = nb::none(),
      nb::sig("def replay(path: str | os.PathLike[str], *, arm: Arm | None = None, settings: ControllerSettings | None = None) "
              "-> ReplayResult"),
      "Gives a controller what a recording holds, step by step, and compares its commands with the recorded ones, bit for bit.\n"
      "The arm and the settings are in the recording; with others the notes name what differs. Raises OSError where the file cannot\n"
      "be read, ValueError that says what is wrong with it.");
}

}  // namespace sidestep::python
