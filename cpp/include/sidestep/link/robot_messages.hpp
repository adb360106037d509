#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "sidestep/controller/settings.hpp"
#include "sidestep/link/message.hpp"
#include "sidestep/robot/robot.hpp"

// Between a robot (a simulator is one) and its driver. The robot listens and says RobotHello first, then RobotStateMessage every
// cycle. The driver says RobotStart, answers states with RobotCommandMessage, and ends control by RobotStop.
namespace sidestep::link {

struct RobotHello {
  static constexpr MessageInfo info{MessageType::robot_hello, "RobotHello", Sender::robot, 65536, "What the robot is."};

  std::string name;
  std::vector<std::string> joints;
  JointLimits limits;  ///< (nv) each
  std::vector<ControllerSettings::Output> outputs;
  double period = 0.001;
  bool paced = true, real_time = true;
  std::string when_silent;

  void check() const;
};
void each_field(Of<RobotHello> auto& m, auto&& visit) {
  visit("name", m.name, "of the robot");
  visit("joints", m.joints, "names, in the order of all vectors (nv)");
  visit("lower", m.limits.lower, "position limit (nv) [rad | m]; -inf: none");
  visit("upper", m.limits.upper, "position limit (nv) [rad | m]; inf: none");
  visit("velocity", m.limits.velocity, "limit (nv) [rad/s | m/s]");
  visit("acceleration", m.limits.acceleration, "limit (nv) [rad/s² | m/s²]");
  visit("effort", m.limits.effort, "limit (nv) [Nm | N]");
  visit("jerk", m.limits.jerk, "limit (nv) [rad/s³ | m/s³]; empty: 100/s times the acceleration limit");
  visit("effort_rate", m.limits.effort_rate, "limit (nv) [Nm/s | N/s]; empty: none");
  visit("outputs", m.outputs, "what it takes: 1 torque, 2 acceleration, 3 velocity, 4 position");
  visit("period", m.period, "of a cycle [s]");
  visit("paced", m.paced, "a state comes by itself every cycle");
  visit("real_time", m.real_time, "its time is the machine's");
  visit("when_silent", m.when_silent, "in words: what it does when no command comes");
}

struct RobotStart {
  static constexpr MessageInfo info{MessageType::robot_start, "RobotStart", Sender::driver, 64, "The driver begins control."};

  ControllerSettings::Output output = ControllerSettings::Output::position;

  void check() const;
};
void each_field(Of<RobotStart> auto& m, auto&& visit) {
  visit("output", m.output, "of the commands that follow: 1 torque, 2 acceleration, 3 velocity, 4 position");
}

/// Who moves a robot.
enum class RobotMode : std::uint8_t {
  waiting,     ///< nobody yet
  controlled,  ///< a driver
  resting,     ///< nobody any more: it comes to rest, or rests
  stopped,     ///< the same, because it has stopped itself
};

/// NaN is allowed where the robot does not say; what a state that cannot be leads to is the controller's matter.
struct RobotStateMessage {
  static constexpr MessageInfo info{MessageType::robot_state, "RobotStateMessage", Sender::robot, 64 + joint_vectors(6),
                                    "State of the robot in one cycle."};

  std::uint64_t cycle = 0;
  double time = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd q, v, torque, told_position, told_velocity, told_acceleration;
  std::int32_t lost_cycles = 0;
  RobotMode mode = RobotMode::controlled;
  std::uint64_t taken = 0, taken_cycle = 0;

  void check() const;
};
void each_field(Of<RobotStateMessage> auto& m, auto&& visit) {
  visit("cycle", m.cycle, "counts cycles of the robot");
  visit("time", m.time, "when it was measured, on a monotonic clock [s]; NaN: not told");
  visit("q", m.q, "(nv) [rad | m]");
  visit("v", m.v, "(nv) [rad/s | m/s]");
  visit("torque", m.torque, "measured (nv) [Nm | N]; NaN: not told");
  visit("told_position", m.told_position, "what the robot says it goes on from (nv) [rad | m]; NaN: not told");
  visit("told_velocity", m.told_velocity, "likewise (nv) [rad/s | m/s]");
  visit("told_acceleration", m.told_acceleration, "likewise (nv) [rad/s² | m/s²]");
  visit("lost_cycles", m.lost_cycles, "cycles so far in which no command came");
  visit("mode", m.mode, "who moves it: 0 nobody yet, 1 a driver, 2 nobody any more, 3 it has stopped itself");
  visit("taken", m.taken, "sequence number of the newest command that moves it; 0: none yet, or it does not say");
  visit("taken_cycle", m.taken_cycle, "cycle since which it moves it");
}

struct RobotCommandMessage {
  static constexpr MessageInfo info{MessageType::robot_command, "RobotCommandMessage", Sender::driver, 32 + joint_vectors(1),
                                    "Command of one cycle."};

  std::uint64_t cycle = 0;
  ControllerSettings::Output output = ControllerSettings::Output::position;
  Eigen::VectorXd values;

  void check() const;
};
void each_field(Of<RobotCommandMessage> auto& m, auto&& visit) {
  visit("cycle", m.cycle, "of the state that it answers");
  visit("output", m.output, "what the values are: 1 torque, 2 acceleration, 3 velocity, 4 position");
  visit("values", m.values, "(nv) torque without gravity [Nm | N], or [rad/s² | m/s²], [rad/s | m/s], [rad | m]");
}

struct RobotStop {
  static constexpr MessageInfo info{MessageType::robot_stop, "RobotStop", Sender::either_side_of_robot, 8 + longest_text,
                                    "From the driver: control ends, the robot holds. From the robot: it has stopped itself."};

  std::string words;

  void check() const;
};
void each_field(Of<RobotStop> auto& m, auto&& visit) { visit("words", m.words, "why"); }

/// For viewers, less often than states.
struct RobotObjects {
  static constexpr std::size_t most_objects = 4096;
  static constexpr MessageInfo info{MessageType::robot_objects, "RobotObjects", Sender::robot, most_objects * 128,
                                    "Where a simulator has what is around the robot."};

  std::vector<std::string> names;
  Eigen::MatrixXd poses;

  void check() const;
};
void each_field(Of<RobotObjects> auto& m, auto&& visit) {
  visit("names", m.names, "of the objects (N)");
  visit("poses", m.poses, "(N, 7) position [m] and quaternion (w, x, y, z) in the world");
}

}  // namespace sidestep::link
