#include "sidestep/loop/loop.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "python_driver.hpp"
#include "settings.hpp"
#include "sidestep/loop/clock_lateness.hpp"
#include "sidestep/loop/ideal_driver.hpp"
#include "sidestep/loop/supervisor.hpp"

namespace sidestep::python {
namespace {

constexpr std::chrono::milliseconds waiting_pause{2};  // Time between two looks at whether a run has ended.

/// The observers of a run, which Python holds.
std::vector<CycleObserver*> as_observers(const std::vector<nb::object>& given) {
  std::vector<CycleObserver*> all;
  for (const nb::object& one : given) {
    all.push_back(&const_cast<CycleObserver&>(as_instance<CycleObserver>(one, "observers", "observers of cycles, such as a Supervisor or a Server")));
  }
  return all;
}

/// A run as Python holds it: it keeps what it works on, and its end does not wait with the GIL.
class PythonLoop {
 public:
  PythonLoop(nb::object controller, nb::object driver, const LoopSettings& settings, std::vector<nb::object> observers)
      : controller_(std::move(controller)), driver_(std::move(driver)), kept_(std::move(observers)) {
    Driver* native = nullptr;
    if (!nb::try_cast<Driver*>(driver_, native) || native == nullptr) {
      own_ = std::make_unique<PythonDriver>(driver_);
      native = own_.get();
    }
    Controller& used = const_cast<Controller&>(as_instance<Controller>(controller_, "controller", "a Controller"));
    loop_ = std::make_unique<Loop>(used, *native, settings, as_observers(kept_));
  }
  ~PythonLoop() {
    const nb::gil_scoped_release release;
    loop_.reset();
  }
  PythonLoop(const PythonLoop&) = delete;
  PythonLoop& operator=(const PythonLoop&) = delete;

  void start() {
    try {
      interruptible([&](const Interrupted&) {
        loop_->start();
        return true;
      });
    } catch (const std::runtime_error&) {
      if (own_) {
        own_->raise_error();  // the driver's own exception says more
      }
      throw;
    }
  }
  bool wait(double seconds) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point until = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    return interruptible([&](const Interrupted& interrupted) {
      while (loop_->is_running() && Clock::now() < until && !interrupted()) {
        std::this_thread::sleep_for(waiting_pause);
      }
      return !loop_->is_running();
    });
  }
  const RunReport& finish() {
    try {
      interruptible([&](const Interrupted& interrupted) {
        while (loop_->is_running() && !interrupted()) {
          std::this_thread::sleep_for(waiting_pause);
        }
        return true;
      });
    } catch (...) {
      loop_->stop(RunEnd::interrupted, "Ctrl-C");
      const nb::gil_scoped_release release;
      loop_->finish();
      throw;
    }
    const nb::gil_scoped_release release;
    return loop_->finish();
  }
  Loop& loop() noexcept { return *loop_; }

 private:
  nb::object controller_, driver_;
  std::vector<nb::object> kept_;
  std::unique_ptr<PythonDriver> own_;
  std::unique_ptr<Loop> loop_;
};

void bind_report(nb::module_& m) {
  nb::enum_<RunEnd>(m, "RunEnd", "Why a run ended.")
      .value("running", RunEnd::running, "It has not ended.")
      .value("arrived", RunEnd::arrived, "The arm has been at its goal for `hold`, or `until` said so.")
      .value("duration", RunEnd::duration, "Its time was over.")
      .value("stopped", RunEnd::stopped, "Somebody asked for it.")
      .value("interrupted", RunEnd::interrupted, "Ctrl-C.")
      .value("failed", RunEnd::failed, "An exception of the program around it.")
      .value("state_lost", RunEnd::state_lost, "No new state came from the robot, or the connection is gone.")
      .value("robot_stopped", RunEnd::robot_stopped, "The robot has stopped itself.")
      .value("late", RunEnd::late, "The loop was later than `longest_gap`.")
      .value("source_silent", RunEnd::source_silent, "A source of obstacles was overdue for `silent_timeout`.")
      .value("denied", RunEnd::denied, "A supervisor did not approve of a command.");
  nb::class_<RunReport>(m, "RunReport", "What a run on a robot was.")
      .def_ro("end", &RunReport::end, "Why it ended.")
      .def_ro("why", &RunReport::why, "The same in words.")
      .def_ro("at_the_end", &RunReport::at_the_end, "What the controller said last, see `Controller.explain`.")
      .def_ro("cycles", &RunReport::cycles, "Commands that were computed.")
      .def_ro("missed", &RunReport::missed, "Cycles that ended after the next one was due.")
      .def_ro("lost", &RunReport::lost, "Cycles in which the robot went on without a command, as it says.")
      .def_ro("unwritten", &RunReport::unwritten, "Commands that were not written: without a position, or not approved.")
      .def_ro("worst", &RunReport::worst, "Most severe status of a command.")
      .def_ro("stop_time", &RunReport::stop_time, "Time from the reason to the end until the loop let go of the arm [s].")
      .def_ro("at_rest", &RunReport::at_rest, "The arm was at rest, as measured, when the loop let go of it.")
      .def_ro("scheduling", &RunReport::scheduling, "What the machine permitted, in words.")
      .def_ro("prioritised", &RunReport::prioritised, "Whether real-time scheduling was permitted.")
      .def_prop_ro("late", [](const RunReport& r) { return to_numpy(r.late); },
                   "(T,) of the last cycles: time from when each was due until it began [s]; 0 where the robot is the pace.")
      .def_prop_ro("taken", [](const RunReport& r) { return to_numpy(r.taken); },
                   "(T,) of the last cycles: time from the state until the command was written [s].")
      .def_prop_ro("is_success", &RunReport::is_success, "Whether nothing ended the run before its time.")
      .def("__repr__", [](const RunReport& r) {
        return std::string("RunReport(") + to_string(r.end) + (r.why.empty() ? "" : ": " + r.why) + ", " + std::to_string(r.cycles) +
               " cycles, " + std::to_string(r.missed) + " missed, worst " + to_string(r.worst) + ")";
      });
}

void bind_supervisor(nb::module_& m) {
  bind_settings<SupervisorSettings>(m, "SupervisorSettings", "How far a supervisor lets things go.");
  nb::class_<SupervisorLink, CycleObserver>(
      m, "SupervisorLink",
      "The loop's side of a supervisor, see `sidestep.loop.Supervisor`: it reports each cycle in memory that two processes share, and\n"
      "approves only what the other process has approved.")
      .def(
          "__init__",
          [](SupervisorLink* self, const Controller& controller, nb::handle settings) {
            new (self) SupervisorLink(controller.arm().robot(), output_of(controller), controller.settings().period,
                                      settings.is_none() ? SupervisorSettings{}
                                                         : as_instance<SupervisorSettings>(settings, "settings", "SupervisorSettings or None"));
          },
          nb::arg("controller"), nb::arg("settings") = nb::none(),
          nb::sig("def __init__(self, controller: Controller, settings: SupervisorSettings | None = None) -> None"))
      .def_prop_ro("path", &SupervisorLink::path, "The file of the shared memory.")
      .def("wait_for_supervisor", &SupervisorLink::wait_for_supervisor, nb::arg("timeout"), nb::call_guard<nb::gil_scoped_release>(),
           "Waits so long at most [s] until the other process answers; whether it does.")
      .def_prop_ro("approves", [](const SupervisorLink& self) { return self.verdict().approves(); }, "Whether its last verdict approves.")
      .def_prop_ro("why", &SupervisorLink::why, "What it said last to a loop, in words.")
      .def("reset", &SupervisorLink::reset, "What was denied may be tried again.");
  m.def(
      "supervise",
      [](const std::string& path) {
        interruptible([&](const Interrupted& interrupted) {
          supervise(path, [&] { return interrupted(); });
          return true;
        });
      },
      nb::arg("path"), "The other process of a SupervisorLink: judges what its loop reports until that process is gone, or Ctrl-C.");
}

}  // namespace

void bind_loop(nb::module_& m) {
  bind_robot_state(m);
  bind_report(m);
  nb::exception<RobotStopped>(m, "RobotStopped", PyExc_RuntimeError);
  bind_settings<LoopSettings>(m, "LoopSettings", "How a run on a robot goes, and when it ends.");
  m.def(
      "clock_lateness",
      [](double seconds, double period, int priority) {
        const Eigen::VectorXd late = [&] {
          const nb::gil_scoped_release release;
          return clock_lateness(seconds, period, priority);
        }();
        return to_numpy(late);
      },
      nb::arg("seconds"), nb::kw_only(), nb::arg("period") = 0.001, nb::arg("priority") = LoopSettings().priority,
      nb::sig("def clock_lateness(seconds: float, *, period: float = 0.001, priority: int = 60) -> numpy.typing.NDArray[numpy.float64]"),
      "How late a thread wakes (T,) [s] that does nothing but wait for its turn, once a period [s]: what a loop on this machine cannot be\n"
      "better than.");
  m.def(
      "supervisor_settings_fields",
      [] {
        nb::list rows;
        describe_fields<SupervisorSettings>(rows, "");
        return rows;
      },
      nb::sig("def supervisor_settings_fields() -> list[dict[str, float | str]]"), "Every setting of a Supervisor, as `controller_settings_fields`.");
  m.def(
      "loop_settings_fields",
      [] {
        nb::list rows;
        describe_fields<LoopSettings>(rows, "");
        return rows;
      },
      nb::sig("def loop_settings_fields() -> list[dict[str, float | str]]"), "Every setting of a Loop, as `controller_settings_fields`.");
  nb::class_<Driver>(m, "NativeDriver", "A driver that needs no Python in the loop.")
      .def_prop_ro("description", &Driver::description, nb::rv_policy::reference_internal, "RobotDescription of its robot.")
      .def(
          "read",
          [](Driver& self, int num_coordinates, double timeout) -> std::optional<RobotState> {
            RobotState state(num_coordinates);
            DriverResult result = DriverResult::waiting;
            {
              const nb::gil_scoped_release others;
              result = self.read(state, timeout);
            }
            if (result == DriverResult::lost || result == DriverResult::stopped) {
              throw std::runtime_error(self.trouble());
            }
            return result == DriverResult::ok ? std::optional<RobotState>(std::move(state)) : std::nullopt;
          },
          nb::arg("num_coordinates"), nb::arg("timeout") = 0.1,
          "The robot's next state, for who only looks: not while a run goes on with this driver. None: there was none within timeout [s].\n"
          "Raises RuntimeError where the connection is gone or the robot has stopped itself.")
      .def_prop_ro("trouble", &Driver::trouble, "Why the last call failed, in words.");
  nb::class_<IdealDriver, Driver>(
      m, "IdealDriver",
      "An ideal robot: it tracks every command exactly. With torque or acceleration v += a T, q += v T; with velocity or position it is\n"
      "where the reference is, at its speed. Its clock is the machine's; real_time=False: its own, as fast as the loop can.")
      .def(
          "__init__",
          [](IdealDriver* self, nb::handle arm, nb::handle q, nb::handle v, double period, bool real_time) {
            const Arm& of = as_instance<Arm>(arm, "arm", "an Arm, such as Arm.load('fr3')");
            new (self) IdealDriver(of, q.is_none() ? of.neutral() : as_vector(q, "q", of.num_coordinates()), period, real_time,
                                   v.is_none() ? Eigen::VectorXd() : as_vector(v, "v", of.num_coordinates()));
          },
          nb::arg("arm"), nb::arg("q") = nb::none(), nb::kw_only(), nb::arg("v") = nb::none(), nb::arg("period") = 0.001, nb::arg("real_time") = true,
          nb::sig("def __init__(self, arm: Arm, q: numpy.typing.ArrayLike | None = None, *, v: numpy.typing.ArrayLike | None = None, period: float = 0.001, real_time: bool = True) -> None"))
      .def("__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> IdealDriver"))
      .def("__exit__", [](IdealDriver& self, nb::handle, nb::handle, nb::handle) { self.stop(); }, nb::arg("type").none(),
           nb::arg("value").none(), nb::arg("traceback").none(),
           nb::sig("def __exit__(self, type: typing.Any, value: typing.Any, traceback: typing.Any) -> None"));
  nb::class_<CycleObserver>(m, "CycleObserver", "Takes part in every cycle of a Loop, in its thread.");
  bind_supervisor(m);
  nb::class_<PythonLoop>(
      m, "Loop",
      "Runs a Controller on a robot in a real-time thread of its own: reads the state, steps, writes the command, once a period. See\n"
      "`sidestep.run`, which makes one and waits for its end. Before the first motion it checks that controller and robot fit (joints,\n"
      "limits, period, output: ValueError), that the state is plausible and free, and that obstacles are known (RuntimeError by `start`).\n"
      "However it ends, the arm is brought to rest within its limits and clearances first. RuntimeError if the controller is in use.")
      .def(
          "__init__",
          [](PythonLoop* self, nb::object controller, nb::object driver, nb::handle settings, std::optional<bool> until_arrived,
             std::optional<double> duration, std::vector<nb::object> observers) {
            LoopSettings given = settings.is_none() ? LoopSettings{} : as_instance<LoopSettings>(settings, "settings", "LoopSettings or None");
            given.until_arrived = until_arrived.value_or(given.until_arrived);
            given.duration = duration.value_or(given.duration);
            new (self) PythonLoop(std::move(controller), std::move(driver), given, std::move(observers));
          },
          nb::arg("controller"), nb::arg("driver"), nb::arg("settings") = nb::none(), nb::kw_only(), nb::arg("until_arrived") = nb::none(),
          nb::arg("duration") = nb::none(), nb::arg("observers") = std::vector<nb::object>{},
          nb::sig("def __init__(self, controller: Controller, driver: typing.Any, settings: LoopSettings | None = None, *, until_arrived: bool | "
                  "None = None, duration: float | None = None, observers: collections.abc.Sequence[CycleObserver] = ()) -> None"))
      .def("start", &PythonLoop::start, "Checks state and world, and begins. Raises RuntimeError that says what is wrong and what to do.")
      .def(
          "stop",
          [](PythonLoop& self, nb::handle end, const std::string& why) { self.loop().stop(as_enum<RunEnd>(end, "end"), why); },
          nb::arg("end") = "stopped", nb::arg("why") = "",
          nb::sig("def stop(self, end: RunEnd | str = 'stopped', why: str = '') -> None"),
          "Ends the run: brings the arm to rest first. Waits for nothing; the first reason counts.")
      .def("wait", &PythonLoop::wait, nb::arg("seconds"), "Waits so long at most [s]; whether the run has ended. Ctrl-C raises, the run goes on.")
      .def("finish", &PythonLoop::finish, nb::rv_policy::copy, "Waits for the end; the RunReport. Ctrl-C stops the run, and raises once the arm is at rest.")
      .def_prop_ro("is_running", [](PythonLoop& self) { return self.loop().is_running(); }, "Whether the run has not ended.")
      .def_prop_ro("is_stopping", [](PythonLoop& self) { return self.loop().is_stopping(); }, "Whether the arm is being brought to rest.")
      .def("state", [](PythonLoop& self) { return RobotState(self.loop().state()); }, "The newest RobotState; for one thread.")
      .def("__repr__", [](PythonLoop& self) { return std::string("Loop(") + (self.loop().is_running() ? "running)" : "ended)"); });
  bind_model_loop(m);
}

}  // namespace sidestep::python
