#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <string>

#include "sidestep/link/robot_messages.hpp"
#include "sidestep/link/socket.hpp"
#include "sidestep/link/commands_in_flight.hpp"
#include "sidestep/loop/driver.hpp"

namespace sidestep::link {

/// Drives a robot that speaks the messages of robot_messages.hpp: the simulator of `sidestep simulate`, or one of your own.
///
/// Over a connection that is late, with torque or acceleration output, the state that is read is moved on to the cycle in which the next
/// command arrives, by the commands that are on their way (CommandsInFlight). Over one without delay it is the state as it came.
class SimulatorDriver : public Driver {
 public:
  static constexpr double start_timeout = 3.0;  ///< until the robot lets itself be controlled [s]

  /// Connects, and waits at most `timeout` [s] for the robot's hello. Throws std::system_error where nobody listens, std::runtime_error
  /// where no hello comes, std::invalid_argument where it is malformed.
  explicit SimulatorDriver(const std::string& address, double timeout = 5.0);

  const RobotDescription& description() const noexcept override { return description_; }
  /// Throws std::runtime_error where the robot refuses, or does not answer in `start_timeout`.
  void start(ControllerSettings::Output output) override;
  /// Where the connection was lost, and no run goes on, it connects anew.
  DriverResult read(RobotState& state, double timeout) noexcept override;
  DriverResult write(const Command& command) noexcept override;
  void stop() noexcept override;
  std::string trouble() const override { return trouble_; }
  /// Ends the connection.
  void close() noexcept { connection_.close(); }

  /// From a state to the cycle in which its command moves the robot [s].
  double delay() const noexcept { return description_.period * in_flight_.delay(); }

 private:
  /// Reads messages until the newest state is in `message_`, or until then.
  DriverResult receive(std::chrono::steady_clock::time_point deadline);
  /// The robot's drives track positions or velocities.
  bool drives_track() const noexcept;
  /// Whether the state in `message_` is for the one who asked for it, and newer than the last.
  bool is_new() const noexcept;
  DriverResult fail(DriverResult result, const std::string& why) noexcept;
  /// Connects anew; false: nobody answers, or another robot does.
  bool reconnect(double timeout);

  std::string address_;
  Connection connection_;
  RobotDescription description_;
  RobotStateMessage message_;
  RobotCommandMessage command_;
  RobotStop stop_;
  CommandsInFlight in_flight_;
  std::string trouble_;
  std::uint64_t started_after_ = 0;
  std::int32_t lost_before_ = 0;
  double last_time_ = 0.0;    // of the last state that was moved on [s]
  bool has_read_ = false;     // some state was read
  bool controls_ = false;     // between start and stop
  bool has_control_ = false;  // the robot has said so
  bool is_kept_ = false;      // message_ was read by start, and is for the next read
  bool has_stopped_ = false;  // the robot has stopped itself
};

}  // namespace sidestep::link
