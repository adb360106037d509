#include "sidestep/link/simulator_driver.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "polling.hpp"

namespace sidestep::link {
namespace {

constexpr double least_step = 0.25;  // Least time from one state to the next, as a share of a cycle [-].

/// What the robot at the other end is; the first message that it sends.
RobotDescription hear_hello(Connection& connection, double timeout) {
  RawMessage raw;
  if (connection.receive(raw, timeout) != Received::message) {
    throw std::runtime_error("the robot did not say what it is: " + (connection.trouble().empty()
                                                                         ? "nothing came for " + std::to_string(timeout) + " s"
                                                                         : connection.trouble()));
  }
  if (raw.header.type == MessageType::robot_stop) {
    RobotStop stop;
    decode(raw.payload, stop);
    throw std::runtime_error("the robot refuses: " + stop.words);
  }
  if (raw.header.type != MessageType::robot_hello) {
    throw std::runtime_error("the other side is no robot: its first message is of type " +
                             std::to_string(static_cast<int>(raw.header.type)) + ", not RobotHello");
  }
  RobotHello hello;
  decode(raw.payload, hello);
  RobotDescription robot;
  robot.name = hello.name;
  robot.joints = hello.joints;
  robot.limits = hello.limits;
  robot.outputs = hello.outputs;
  robot.period = hello.period;
  robot.paced = hello.paced;
  robot.real_time = hello.real_time;
  robot.when_silent = hello.when_silent;
  return robot;
}

const Eigen::VectorXd& values_of(const Command& command, ControllerSettings::Output output) noexcept {
  switch (output) {
    case ControllerSettings::Output::acceleration: return command.acceleration;
    case ControllerSettings::Output::velocity: return command.velocity;
    case ControllerSettings::Output::position: return command.position;
    default: return command.torque_without_gravity;
  }
}

}  // namespace

SimulatorDriver::SimulatorDriver(const std::string& address, double timeout)
    : address_(address),
      connection_(Address(address)),
      description_(hear_hello(connection_, timeout)),
      in_flight_(static_cast<Eigen::Index>(description_.joints.size()), description_.period) {
  command_.values = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(description_.joints.size()));
  trouble_.reserve(longest_text);
}

void SimulatorDriver::start(ControllerSettings::Output output) {
  command_.output = output;
  in_flight_.clear();
  last_time_ = -std::numeric_limits<double>::infinity();
  started_after_ = message_.cycle;
  has_control_ = has_stopped_ = is_kept_ = false;
  if (!connection_.send(RobotStart{output}, start_timeout)) {
    throw std::runtime_error("the robot cannot be reached: " + connection_.trouble());
  }
  controls_ = true;
  const auto end = deadline_in(start_timeout);
  while (!has_control_) {
    const DriverResult result = receive(end);
    if (result == DriverResult::ok && message_.mode == RobotMode::controlled) {
      has_control_ = is_kept_ = true;
    } else if (result == DriverResult::lost || result == DriverResult::stopped) {
      controls_ = false;
      throw std::runtime_error("the robot does not let itself be controlled: " + trouble_);
    } else if (time_left(end) <= 0.0) {
      stop();
      throw std::runtime_error("the robot did not answer the start for " + std::to_string(start_timeout) + " s");
    }
  }
}

DriverResult SimulatorDriver::fail(DriverResult result, const std::string& why) noexcept {
  try {
    trouble_ = why;
  } catch (...) {  // out of memory: without words
  }
  return result;
}

DriverResult SimulatorDriver::receive(std::chrono::steady_clock::time_point deadline) {
  bool found = false;
  for (;;) {
    RawMessage raw;
    switch (connection_.receive(raw, found ? 0.0 : time_left(deadline))) {
      case Received::nothing: return found ? DriverResult::ok : DriverResult::waiting;
      case Received::refused:
      case Received::closed: return fail(DriverResult::lost, connection_.trouble());
      case Received::message: break;
    }
    if (raw.header.type == MessageType::robot_stop) {
      decode(raw.payload, stop_);
      has_stopped_ = true;
      return fail(DriverResult::stopped, stop_.words);
    }
    if (raw.header.type == MessageType::robot_state) {
      decode(raw.payload, message_);
      found = true;
    }
  }
}

bool SimulatorDriver::drives_track() const noexcept {
  return command_.output == ControllerSettings::Output::velocity || command_.output == ControllerSettings::Output::position;
}

bool SimulatorDriver::is_new() const noexcept {
  return !controls_ || (message_.mode == RobotMode::controlled && message_.cycle >= started_after_);
}

bool SimulatorDriver::reconnect(double timeout) {
  Connection fresh{Address(address_)};
  const RobotDescription robot = hear_hello(fresh, timeout);
  if (robot.joints != description_.joints || robot.period != description_.period) {
    fail(DriverResult::lost, "another robot answers: '" + robot.name + "'");
    return false;
  }
  connection_ = std::move(fresh);
  in_flight_.clear();
  message_ = {};
  has_stopped_ = has_read_ = is_kept_ = false;
  return true;
}

DriverResult SimulatorDriver::read(RobotState& state, double timeout) noexcept {
  try {
    const auto end = deadline_in(timeout);
    if (!controls_ && !connection_.is_open() && !reconnect(timeout)) {
      return DriverResult::lost;
    }
    if (has_stopped_ && controls_) {
      return DriverResult::stopped;
    }
    while (!is_kept_) {
      const DriverResult result = receive(end);
      if (result != DriverResult::ok) {
        return result;
      }
      if (is_new()) {
        break;
      }
      if (message_.mode == RobotMode::stopped && has_control_) {
        has_stopped_ = true;
        return fail(DriverResult::stopped, "the robot has stopped itself");
      }
    }
    is_kept_ = false;
    if (message_.q.size() != command_.values.size() || message_.v.size() != message_.q.size()) {
      return fail(DriverResult::lost, "the robot's state has another number of joints than its hello");
    }
    state.time = message_.time;
    state.q = message_.q;
    state.v = message_.v;
    state.torque = message_.torque;
    state.told_position = message_.told_position;
    state.told_velocity = message_.told_velocity;
    state.told_acceleration = message_.told_acceleration;
    state.lost_cycles = has_read_ ? std::max(0, message_.lost_cycles - lost_before_) : 0;
    lost_before_ = message_.lost_cycles;
    has_read_ = true;
    if (controls_ && message_.taken > 0) {
      in_flight_.taken(message_.taken, message_.taken_cycle);
    }
    if (controls_ && !drives_track()) {
      state.time += description_.period * in_flight_.predict(message_.cycle, state.q, state.v);
      // Where the delay becomes shorter, time goes on slowly for a while: never back.
      state.time = std::max(state.time, last_time_ + least_step * description_.period);
      last_time_ = state.time;
    }
    return DriverResult::ok;
  } catch (const std::exception& error) {
    return fail(DriverResult::lost, error.what());
  }
}

DriverResult SimulatorDriver::write(const Command& command) noexcept {
  try {
    if (has_stopped_) {
      return DriverResult::stopped;
    }
    const Eigen::VectorXd& values = values_of(command, command_.output);
    if (!values.allFinite()) {
      return DriverResult::ok;  // the robot holds what it has
    }
    command_.values = values;
    command_.cycle = message_.cycle;
    if (!connection_.send(command_, 0.0)) {
      return fail(DriverResult::lost, connection_.trouble());
    }
    in_flight_.sent(connection_.sequence(), message_.cycle, command.acceleration);
    return DriverResult::ok;
  } catch (const std::exception& error) {
    return fail(DriverResult::lost, error.what());
  }
}

void SimulatorDriver::stop() noexcept {
  try {
    if (controls_ && connection_.is_open()) {
      connection_.send(RobotStop{"the driver ends control"}, 0.1);
    }
  } catch (const std::exception&) {  // out of memory: the robot brakes by itself
  }
  controls_ = has_control_ = is_kept_ = false;
}

}  // namespace sidestep::link
