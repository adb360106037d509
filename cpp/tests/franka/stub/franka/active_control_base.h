#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace franka {

enum class RobotMode { kOther, kIdle, kMove, kGuiding, kReflex };

/// The members that the driver reads.
struct RobotState {
  std::array<double, 7> q{}, dq{}, tau_J{}, q_d{}, dq_d{}, ddq_d{}, tau_J_d{};
  double control_command_success_rate = 1.0;
  RobotMode robot_mode = RobotMode::kIdle;
};

class Duration {
 public:
  explicit Duration(std::uint64_t milliseconds) : milliseconds_(milliseconds) {}
  std::uint64_t toMSec() const { return milliseconds_; }

 private:
  std::uint64_t milliseconds_;
};

struct Torques {
  explicit Torques(const std::array<double, 7>& values) : tau_J(values) {}
  std::array<double, 7> tau_J;
  bool motion_finished = false;
};
struct JointVelocities {
  explicit JointVelocities(const std::array<double, 7>& values) : dq(values) {}
  std::array<double, 7> dq;
  bool motion_finished = false;
};
struct JointPositions {
  explicit JointPositions(const std::array<double, 7>& values) : q(values) {}
  std::array<double, 7> q;
  bool motion_finished = false;
};
template <class Command>
Command MotionFinished(Command command) {
  command.motion_finished = true;
  return command;
}

class ActiveControlBase {
 public:
  virtual ~ActiveControlBase() = default;
  virtual std::pair<RobotState, Duration> readOnce() = 0;
  virtual void writeOnce(const Torques&) = 0;
  virtual void writeOnce(const JointVelocities&) = 0;
  virtual void writeOnce(const JointPositions&) = 0;
};

}  // namespace franka
