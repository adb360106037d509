#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sidestep/controller/command.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/link/message.hpp"
#include "sidestep/loop/robot_state.hpp"

// From a server to its clients. Answers have the sequence number of their request.
namespace sidestep::link {

struct Welcome {
  static constexpr MessageInfo info{MessageType::welcome, "Welcome", Sender::server, 65536, "Answer to Hello: what is served."};

  std::string server, sidestep_version, arm;
  std::vector<std::string> joints, frames, cameras;
  Eigen::VectorXd lower, upper, velocity;
  double period = 0.001;
  ControllerSettings::Output output = ControllerSettings::Output::automatic;
  std::uint32_t client = 0;
  bool may_command = false;
};
void each_field(Of<Welcome> auto& m, auto&& visit) {
  visit("server", m.server, "name of the server");
  visit("sidestep_version", m.sidestep_version, "of the server");
  visit("arm", m.arm, "name of the arm");
  visit("joints", m.joints, "(nv) names, in the order of all vectors");
  visit("frames", m.frames, "names that poses and twists may have");
  visit("cameras", m.cameras, "names of the cameras whose images are taken");
  visit("lower", m.lower, "position limit (nv) [rad | m]");
  visit("upper", m.upper, "position limit (nv) [rad | m]");
  visit("velocity", m.velocity, "limit (nv) [rad/s | m/s]");
  visit("period", m.period, "of the steps [s]");
  visit("output", m.output, "1 torque, 2 acceleration, 3 velocity, 4 position");
  visit("client", m.client, "number of this client");
  visit("may_command", m.may_command, "the token was right");
}

struct Done {
  static constexpr MessageInfo info{MessageType::done, "Done", Sender::server, 65536, "The request was taken."};
  std::uint64_t cycle = 0;
  std::string words;
};
void each_field(Of<Done> auto& m, auto&& visit) {
  visit("cycle", m.cycle, "number of the last cycle before: that of the second after it follows the request");
  visit("words", m.words, "what is hard to believe in it, such as millimetres for metres; empty: nothing");
}

struct Refused {
  static constexpr MessageInfo info{MessageType::refused, "Refused", Sender::server, 65536,
                                    "The request was refused, and nothing has changed."};
  std::string words;
};
void each_field(Of<Refused> auto& m, auto&& visit) { visit("words", m.words, "why, and what is allowed"); }

struct Explanation {
  static constexpr MessageInfo info{MessageType::explanation, "Explanation", Sender::server, 65536, "Answer to Explain."};
  std::string words;
};
void each_field(Of<Explanation> auto& m, auto&& visit) { visit("words", m.words, "one sentence"); }

struct Notice {
  static constexpr MessageInfo info{MessageType::notice, "Notice", Sender::server, 65536,
                                    "Something that every client should know."};
  enum class Kind : std::uint8_t {
    command_taken = 1,
    command_free = 2,
    run_began = 3,
    run_ended = 4,
    image_refused = 5,
    closing = 6
  };

  Kind kind = Kind::command_free;
  std::uint32_t client = 0;
  std::string words;

  void check() const;
};
void each_field(Of<Notice> auto& m, auto&& visit) {
  visit(
      "kind", m.kind,
      "1: a client is in command; 2: nobody is; 3: a run began; 4: it ended; 5: an image was refused; 6: the connection ends");
  visit("client", m.client, "that it is about; 0: none");
  visit("words", m.words, "in words");
}

/// One cycle of the loop.
struct CycleMessage {
  static constexpr MessageInfo info{MessageType::cycle, "CycleMessage", Sender::server, 256 + joint_vectors(20),
                                    "State and command of one cycle, as often as Subscribe asks for."};

  explicit CycleMessage(int num_coordinates = 0) : state(num_coordinates), command(num_coordinates) {}

  std::uint64_t cycle = 0;
  double now = 0.0;
  std::uint32_t in_command = 0;
  RobotState state;
  Command command;

  void check() const;
};
/// A field of a command as a message has it: flags, enums and whole numbers as int32.
template <class Visit>
auto as_command_field(Visit& visit) {
  return [&visit](const char* name, auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::is_enum_v<Value> || std::is_same_v<Value, bool>) {
      auto number = static_cast<std::int32_t>(value);
      visit(name, number, "see Command");
      if constexpr (!std::is_const_v<std::remove_reference_t<decltype(value)>>) {
        value = static_cast<Value>(number);
      }
    } else {
      visit(name, value, "see Command");
    }
  };
}
void each_field(Of<CycleMessage> auto& m, auto&& visit) {
  visit("cycle", m.cycle, "counts cycles");
  visit("now", m.now, "of the machine's monotonic clock [s]");
  visit("in_command", m.in_command, "number of the client in command; 0: nobody");
  visit("time", m.state.time, "when the state was measured [s]; NaN: not told");
  visit("q", m.state.q, "(nv) measured [rad | m]");
  visit("v", m.state.v, "(nv) measured [rad/s | m/s]");
  visit("measured_torque", m.state.torque, "(nv) [Nm | N]; NaN: not told");
  visit("told_position", m.state.told_position, "(nv) [rad | m]; NaN: not told");
  visit("told_velocity", m.state.told_velocity, "(nv) [rad/s | m/s]; NaN: not told");
  visit("told_acceleration", m.state.told_acceleration, "(nv) [rad/s² | m/s²]; NaN: not told");
  visit("lost_cycles", m.state.lost_cycles, "cycles since the state before without a command");
  sidestep::each_field(m.command, as_command_field(visit));
}

}  // namespace sidestep::link
