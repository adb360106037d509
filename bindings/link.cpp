// Links between programs: a server for what steps here, and a client for what steps elsewhere.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "sidestep/link/token.hpp"
#include "arguments.hpp"
#include "depth_pixels.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "os_errors.hpp"
#include "system.hpp"
#include "sidestep/link/client.hpp"
#include "sidestep/link/message_table.hpp"
#include "sidestep/link/server.hpp"

namespace sidestep::python {
namespace {

using link::Client;
using link::CycleMessage;

/// Words of a request that are hard to believe become a warning.
template <class Ask>
void ask(Ask&& action) {
  std::string doubt;
  {
    const nb::gil_scoped_release others;
    doubt = action();
  }
  if (!doubt.empty()) {
    warn(doubt);
  }
}

/// A method without a value, while others may run.
template <class Method>
auto without_gil(Method method) {
  return [method](Client& self) {
    const nb::gil_scoped_release others;
    return (self.*method)();
  };
}

SourceOptions source_options(nb::handle source, nb::handle time, nb::handle valid_for) {
  return {as_text(source, "source", "the name of a source, such as 'camera'"), as_seconds(time, "time"), as_seconds(valid_for, "valid_for")};
}

/// Waits until Ctrl-C ends it.
bool wait(Client& self, const std::function<bool(const CycleMessage&)>& until, double timeout) {
  return interruptible([&](const Interrupted& interrupted) { return self.wait(until, timeout, interrupted); });
}

void bind_client_requests(nb::class_<Client>& c) {
  c.def("take_command", [](Client& self, bool force, bool keep_goal) {
         const nb::gil_scoped_release others;
         self.take_command(force, keep_goal);
       },
       nb::kw_only(), nb::arg("force") = false, nb::arg("keep_goal") = false,
       "Becomes the client that moves the arm. force: also where another one is, which is told. keep_goal: the goal stays when this\n"
       "client leaves or is lost; else it is cleared, and the arm comes to rest. Raises ValueError where another one is in command.")
      .def("release_command", without_gil(&Client::release_command), "Hands the command back; see `take_command` for what becomes of the goal.")
      .def("set_goal", [](Client& self, nb::handle goal) {
             const Goal made = as_goal(goal, self.num_coordinates());
             ask([&] { return self.set_goal(made); });
           },
           nb::arg("goal").none(),
           nb::sig("def set_goal(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal | Sequence[PoseGoal]) -> None"),
           "As Controller.set_goal. In command.")
      .def("set_velocity", [](Client& self, nb::handle v) {
             const Eigen::VectorXd velocity = as_vector(v, "v", self.num_coordinates());
             ask([&] { return self.set_velocity(velocity); });
           },
           nb::arg("v").none(), nb::sig("def set_velocity(self, v: numpy.typing.ArrayLike) -> None"), "As Controller.set_velocity. In command.")
      .def("set_twist", [](Client& self, nb::handle frame, nb::handle twist, bool local, nb::handle free) {
             const std::string name = as_text(frame, "frame", "the name of a link of the arm");
             const Vector6d given(as_vector(twist, "twist", 6));
             const bool turns = as_enum<TwistFreedom>(free, "free") == TwistFreedom::rotation;
             ask([&] { return self.set_twist(name, given, local, turns); });
           },
           nb::arg("frame").none(), nb::arg("twist").none(), nb::arg("local") = false, nb::arg("free").none() = "none",
           nb::sig("def set_twist(self, frame: str, twist: numpy.typing.ArrayLike, local: bool = False, "
                   "free: TwistFreedom | str = 'none') -> None"),
           "As Controller.set_twist. In command.")
      .def("set_trajectory", [](Client& self, nb::handle q, nb::handle times, nb::handle behaviour) {
             const Eigen::VectorXd at = as_vector(times, "times");
             const Eigen::MatrixXd rows = as_matrix(q, "q", at.size(), self.num_coordinates());
             const auto how = as_enum<TrajectoryBehaviour>(behaviour, "behaviour");
             ask([&] { return self.set_trajectory(rows.transpose(), at, how); });
           },
           nb::arg("q").none(), nb::arg("times").none(), nb::arg("behaviour").none() = "keep_path",
           nb::sig("def set_trajectory(self, q: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, "
                   "behaviour: TrajectoryBehaviour | str = 'keep_path') -> None"),
           "As Controller.set_trajectory. In command.")
      .def("clear_goal", without_gil(&Client::clear_goal), "As Controller.clear_goal. In command.")
      .def("restart", without_gil(&Client::restart), "As Controller.restart. In command.")
      .def("pause", without_gil(&Client::pause), "The arm comes to rest; its goal is kept. With the token.")
      .def("resume", without_gil(&Client::resume), "The arm goes on, after `pause` or after a run has ended. In command.")
      .def("stop_run", [](Client& self, const std::string& why) {
             const nb::gil_scoped_release others;
             self.stop_run(why);
           },
           nb::arg("why") = "", "The arm comes to rest, and the run ends. With the token.");
}

void bind_client_obstacles(nb::class_<Client>& c) {
  c.def("set_obstacles", [](Client& self, nb::handle obstacles, nb::handle source, nb::handle time, nb::handle valid_for) {
         const SourceOptions told = source_options(source, time, valid_for);
         const Obstacles made = as_obstacles(obstacles);
         ask([&] { return self.set_obstacles(made, told); });
       },
       nb::arg("obstacles").none(), nb::arg("source") = SourceOptions::scene, nb::kw_only(), nb::arg("time") = nb::none(),
       nb::arg("valid_for") = nb::none(),
       nb::sig("def set_obstacles(self, obstacles: Obstacles | sidestep.obstacles.Shape | collections.abc.Sequence[Obstacles | "
               "sidestep.obstacles.Shape], source: str = 'scene', *, time: float | None = None, valid_for: float | None = None) -> None"),
       "As Controller.set_obstacles. With the token; the client need not be in command.")
      .def("add_obstacle", [](Client& self, nb::handle obstacle, nb::handle source) {
             const Obstacles made = as_obstacles(obstacle);
             const std::string name = as_text(source, "source", "the name of a source");
             ask([&] { return self.add_obstacle(made, name); });
           },
           nb::arg("obstacle").none(), nb::arg("source") = SourceOptions::scene,
           nb::sig("def add_obstacle(self, obstacle: Obstacles | sidestep.obstacles.Shape, source: str = 'scene') -> None"),
           "As Controller.add_obstacle. With the token.")
      .def("move_obstacle", [](Client& self, nb::handle name, nb::handle pose, nb::handle source, nb::handle time, nb::handle valid_for) {
             const SourceOptions told = source_options(source, time, valid_for);
             const std::string which = as_text(name, "name", "the name of an obstacle");
             const Eigen::Isometry3d X = python::as_pose(pose);
             ask([&] { return self.move_obstacle(which, X, told); });
           },
           nb::arg("name"), nb::arg("pose"), nb::arg("source") = SourceOptions::scene, nb::kw_only(), nb::arg("time") = nb::none(),
           nb::arg("valid_for") = nb::none(),
           nb::sig("def move_obstacle(self, name: str, pose: numpy.typing.ArrayLike, source: str = 'scene', *, time: float | None = None, "
                   "valid_for: float | None = None) -> None"),
           "As Controller.move_obstacle. With the token.")
      .def("remove_obstacle", [](Client& self, nb::handle name, nb::handle source) {
             const std::string which = as_text(name, "name", "the name of an obstacle"), from = as_text(source, "source", "the name of a source");
             const nb::gil_scoped_release others;
             self.remove_obstacle(which, from);
           },
           nb::arg("name"), nb::arg("source") = SourceOptions::scene,
           nb::sig("def remove_obstacle(self, name: str, source: str = 'scene') -> None"), "As Controller.remove_obstacle. With the token.")
      .def("remove_obstacles", [](Client& self, nb::handle source) {
             const std::string from = as_text(source, "source", "the name of a source");
             const nb::gil_scoped_release others;
             self.remove_obstacles(from);
           },
           nb::arg("source") = SourceOptions::scene, nb::sig("def remove_obstacles(self, source: str = 'scene') -> None"),
           "As Controller.remove_obstacles. With the token.")
      .def("expect_obstacles", [](Client& self, nb::handle source) {
             const std::string name = as_text(source, "source", "the name of a source");
             const nb::gil_scoped_release others;
             self.expect_obstacles(name);
           },
           nb::arg("source"), nb::sig("def expect_obstacles(self, source: str) -> None"),
           "As Controller.expect_obstacles. With the token.")
      .def("update", [](Client& self, const std::string& camera, nb::handle depth, nb::handle time, nb::handle unit, nb::handle pose) {
             const DepthPixels pixels = as_depth_pixels(depth, unit);
             const double when = as_seconds(time, "time");
             const std::optional<Eigen::Isometry3d> X = pose.is_none() ? std::nullopt : std::optional(python::as_pose(pose));
             const nb::gil_scoped_release others;
             self.update(camera, pixels.width, pixels.height, pixels.raw, when, X ? &*X : nullptr);
           },
           nb::arg("camera"), nb::arg("depth"), nb::kw_only(), nb::arg("time"), nb::arg("unit") = nb::none(), nb::arg("pose") = nb::none(),
           nb::sig("def update(self, camera: str, depth: numpy.typing.ArrayLike, *, time: float, unit: float | None = None, "
                   "pose: numpy.typing.ArrayLike | None = None) -> None"),
           "An image of one of the server's cameras, as Perception.update. With the token. The server works on it after it has answered;\n"
           "what it then finds wrong is among the `notices`.");
}

void bind_client_views(nb::class_<Client>& c) {
  c.def("subscribe", [](Client& self, double rate) {
         const nb::gil_scoped_release others;
         self.subscribe(rate);
       },
       nb::arg("rate"), "How often cycles come [Hz]; inf: every cycle; 0: none.")
      .def("cycle", without_gil(&Client::cycle), "The newest Cycle. Raises RuntimeError where none has come yet.")
      .def("next_cycle", [](Client& self, std::uint64_t after, double timeout) {
             CycleMessage found;
             bool came = false;
             {
               const nb::gil_scoped_release others;
               came = self.next_cycle(found, after, timeout);
             }
             return came ? std::optional(std::move(found)) : std::nullopt;
           },
           nb::arg("after") = 0, nb::arg("timeout") = 1.0, "The newest Cycle once there is one after that number; None: not within timeout [s].")
      .def("state", [](Client& self) {
             const nb::gil_scoped_release others;
             return self.cycle().state;
           }, "State of the arm in the newest cycle, a RobotState.")
      .def("command", [](Client& self) {
             const nb::gil_scoped_release others;
             return self.cycle().command;
           }, "The Command of the newest cycle.")
      .def("wait", [](Client& self, nb::handle until, double timeout) {
             if (nb::isinstance(until, nb::module_::import_("sidestep.loop.run").attr("Arrived"))) {
               return wait(self, [](const CycleMessage& cycle) { return cycle.command.activity == Activity::arrived; }, timeout);
             }
             if (PyCallable_Check(until.ptr()) == 0) {
               raise_type(until, "until", "sidestep.arrived, or a function of the state");
             }
             return wait(self, [until](const CycleMessage& cycle) {
               const nb::gil_scoped_acquire gil;
               return nb::cast<bool>(until(cycle.state));
             }, timeout);
           },
           nb::arg("until"), nb::arg("timeout") = 60.0,
           nb::sig("def wait(self, until: sidestep.loop.Arrived | collections.abc.Callable[[RobotState], bool], timeout: float = 60.0) -> bool"),
           "Waits until the arm has arrived, or a function of the state is true, in a cycle that follows this client's last request. False:\n"
           "not within timeout [s]. Raises RuntimeError where the run has ended, or another client has taken the command, ConnectionError\n"
           "where the server is gone.")
      .def("explain", without_gil(&Client::explain), "One sentence: what the arm does and why, as Controller.explain.")
      .def("ping", without_gil(&Client::ping), "Time until the server has answered [s].")
      .def("notices", [](Client& self) {
             std::vector<std::string> words;
             for (const link::Notice& notice : self.notices()) {
               words.push_back(notice.words);
             }
             return words;
           }, "What the server has told all clients since the last call, in words.")
      .def("close", without_gil(&Client::close), "Ends the connection.")
      .def("__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> typing.Self"))
      .def("__exit__", [](Client& self, nb::handle, nb::handle, nb::handle) {
             const nb::gil_scoped_release others;
             self.close();
           },
           nb::arg("type").none(), nb::arg("value").none(), nb::arg("traceback").none(), nb::sig("def __exit__(self, type: typing.Any, value: typing.Any, traceback: typing.Any) -> None"))
      .def_prop_ro("in_command", &Client::is_in_command, "Whether this client is the one that moves the arm.")
      .def_prop_ro("may_command", [](const Client& self) { return self.welcome().may_command; }, "Whether the token was right.")
      .def_prop_ro("arm", [](const Client& self) { return self.welcome().arm; }, "Name of the arm.")
      .def_prop_ro("joints", [](const Client& self) { return self.welcome().joints; }, "Names of the joints, in the order of all vectors (nv).")
      .def_prop_ro("frames", [](const Client& self) { return self.welcome().frames; }, "Names of the frames that twists may have.")
      .def_prop_ro("cameras", [](const Client& self) { return self.welcome().cameras; }, "Names of the cameras whose images are taken.")
      .def_prop_ro("lower", [](const Client& self) { return to_numpy(self.welcome().lower); }, "(nv,) position limits [rad | m].")
      .def_prop_ro("upper", [](const Client& self) { return to_numpy(self.welcome().upper); }, "(nv,) position limits [rad | m].")
      .def_prop_ro("period", [](const Client& self) { return self.welcome().period; }, "Of a step [s].")
      .def("__repr__", [](const Client& self) {
        return "Client(arm '" + self.welcome().arm + "'" + (self.is_in_command() ? ", in command)" : ")");
      });
}

void bind_client(nb::module_& m) {
  nb::exception<link::ConnectionLost>(m, "ConnectionLost", PyExc_ConnectionError).doc() = "The server does not answer, or the connection has ended.";
  nb::class_<CycleMessage>(m, "Cycle", "One cycle of a loop, as a client of its server gets it.")
      .def_ro("number", &CycleMessage::cycle, "Counts cycles.")
      .def_ro("time", &CycleMessage::now, "Of the server's monotonic clock [s].")
      .def_ro("state", &CycleMessage::state, "State of the arm.")
      .def_ro("command", &CycleMessage::command, "What it was told.")
      .def_ro("in_command", &CycleMessage::in_command, "Number of the client in command; 0: nobody.")
      .def("__repr__", [](const CycleMessage& c) { return "Cycle(" + std::to_string(c.cycle) + ", " + to_string(c.command.activity) + ")"; });
  auto c = nb::class_<Client>(
      m, "Client",
      "Moves an arm that another program serves: the methods of a Controller over a connection, see `sidestep.connect`. From any thread;\n"
      "each call waits for its answer. Raises ValueError in the server's words where it refuses, ConnectionError where it is gone.");
  c.def("__init__",
        [](Client* self, const std::string& address, const std::string& token, const std::string& name, double rate, double timeout) {
          const link::Address at(address);
          with_os_errors(at.text(), [&] {
            const nb::gil_scoped_release others;
            new (self) Client(at, {name, token, rate, timeout});
          });
        },
        nb::arg("address"), nb::arg("token") = "", nb::kw_only(), nb::arg("name") = "", nb::arg("rate") = 100.0, nb::arg("timeout") = 2.0)
      .def_static("over", [](int descriptor, const std::string& token, const std::string& name, double rate, double timeout) {
             const nb::gil_scoped_release others;
             return std::make_unique<Client>(link::Descriptor(descriptor), link::ClientSettings{name, token, rate, timeout});
           },
           nb::arg("descriptor"), nb::arg("token") = "", nb::kw_only(), nb::arg("name") = "", nb::arg("rate") = 100.0, nb::arg("timeout") = 2.0,
           "A client over a stream socket that is connected, which it closes; for bridges.");
  bind_client_requests(c);
  bind_client_obstacles(c);
  bind_client_views(c);
}

void bind_server(nb::module_& m) {
  using link::ClientInfo;
  nb::class_<ClientInfo>(m, "ClientInfo", "A client of a Server.")
      .def_ro("number", &ClientInfo::number)
      .def_ro("name", &ClientInfo::name)
      .def_ro("may_command", &ClientInfo::may_command, "It has shown the token.")
      .def_ro("in_command", &ClientInfo::in_command, "It is the one that moves the arm.")
      .def_ro("rate", &ClientInfo::rate, "Of the cycles that it is sent [Hz].")
      .def_ro("left_out", &ClientInfo::left_out, "Cycles that it was not sent because it reads too slowly.")
      .def("__repr__", [](const ClientInfo& c) { return "ClientInfo(" + std::to_string(c.number) + ", '" + c.name + (c.in_command ? "', in command)" : "')"); });
  nb::class_<link::Server, CycleObserver>(
      m, "Server",
      "Lets other programs of this machine move the arm of a controller: an observer for `sidestep.run`. It listens at a name ('arm'), a\n"
      "Unix domain socket ('unix:/PATH') or a port of the loopback ('tcp:5555'; 0: one that is free), until it is forgotten. Clients that\n"
      "move the arm show the token in `token_file`, which only this user can read. Raises ValueError on an address that is none, OSError\n"
      "where it is taken.")
      .def("__init__",
           [](link::Server* self, Controller& controller, const std::string& address, const std::optional<std::filesystem::path>& token_file,
              Perception* perception, int most_clients) {
             const link::ServerSettings settings{address, token_file.value_or(""), {}, most_clients};
             with_os_errors(address, [&] { new (self) link::Server(controller, settings, perception); });
           },
           nb::arg("controller"), nb::arg("address") = "arm", nb::kw_only(), nb::arg("token_file") = nb::none(),
           nb::arg("perception").none() = nb::none(), nb::arg("most_clients") = link::ServerSettings().most_clients, nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 5>(),
           nb::sig("def __init__(self, controller: Controller, address: str = 'arm', *, token_file: str | os.PathLike[str] | None = None, "
                   "perception: Perception | None = None, most_clients: int = 16) -> None"))
      .def_prop_ro("address", [](const link::Server& self) { return self.address().text(); }, "Where it listens.")
      .def_prop_ro("token_file", &link::Server::token_file)
      .def_prop_ro("clients", &link::Server::clients)
      .def("run_began", &link::Server::run_began, "Tells clients that a run has begun.")
      .def("run_ended", &link::Server::run_ended, nb::arg("why"), "Tells clients that it has ended.")
      .def("take_stop", &link::Server::take_stop, "Why a client has asked to stop the run since the last call; None: none has.")
      .def("take_resume", &link::Server::take_resume, "Whether the client in command has asked to resume since the last call.")
      .def("__repr__", [](const link::Server& self) {
        return "Server('" + self.address().text() + "', " + std::to_string(self.clients().size()) + " clients)";
      });
}

}  // namespace

void bind_link(nb::module_& m) {
  bind_client(m);
  bind_server(m);
  m.def("link_address", [](const std::string& address) { return link::Address(address).text(); }, nb::arg("address"),
        "An address of a server in full: 'unix:/PATH' or 'tcp:127.0.0.1:PORT'. Raises ValueError that says what is allowed.");
  m.def("link_token", [](const std::string& address) -> std::string {
          const std::filesystem::path file = link::default_token_file(link::Address(address));
          return with_os_errors(file, [&] { return link::read_token(file); });
        }, nb::arg("address"), "The token that a server at this address has left for this user. Raises OSError where there is none.");
  m.def("link_messages", [] {
          nb::list rows;
          for (const link::MessageInfo& info : link::all_messages()) {
            nb::dict row;
            row["type"] = static_cast<int>(info.type);
            row["name"] = info.name;
            row["sender"] = to_string(info.sender);
            row["largest"] = info.largest;
            row["meaning"] = info.meaning;
            nb::list fields;
            for (const link::FieldInfo& field : link::fields_of(info.type)) {
              fields.append(nb::make_tuple(field.name, field.kind, field.meaning));
            }
            row["fields"] = fields;
            rows.append(row);
          }
          return rows;
        },
        nb::sig("def link_messages() -> list[dict[str, typing.Any]]"), "All messages of the protocol, with their fields.");
  m.attr("link_version") = static_cast<int>(link::protocol_version);
  m.attr("link_magic") = link::magic;
}

}  // namespace sidestep::python
