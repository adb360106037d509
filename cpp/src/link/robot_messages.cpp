#include "sidestep/link/robot_messages.hpp"

namespace sidestep::link {
namespace {

void require_output(ControllerSettings::Output output) {
  using Output = ControllerSettings::Output;
  const int number = static_cast<int>(output);
  if (number < static_cast<int>(Output::torque) || number > static_cast<int>(Output::position)) {
    throw std::invalid_argument("output is " + std::to_string(number) +
                                "; allowed are 1 torque, 2 acceleration, 3 velocity, 4 position");
  }
}

}  // namespace

void RobotHello::check() const {
  require_text("name", name);
  require_text("when_silent", when_silent);
  require_at_most("joints", joints.size(), most_joints);
  for (const std::string& joint : joints) {
    require_text("joints", joint);
  }
  const auto nv = static_cast<Eigen::Index>(joints.size());
  require_size("lower", limits.lower.size(), nv);
  require_size("upper", limits.upper.size(), nv);
  require_size("velocity", limits.velocity.size(), nv);
  require_size("acceleration", limits.acceleration.size(), nv);
  require_size("effort", limits.effort.size(), nv);
  if (limits.jerk.size() != 0) {
    require_size("jerk", limits.jerk.size(), nv);
  }
  if (limits.effort_rate.size() != 0) {
    require_size("effort_rate", limits.effort_rate.size(), nv);
  }
  require_at_most("outputs", outputs.size(), 4);
  for (const auto output : outputs) {
    require_output(output);
  }
  if (!(period > 0.0 && period <= 1.0)) {
    throw std::invalid_argument("period is " + std::to_string(period) + " s; allowed: above 0, at most 1");
  }
}

void RobotStart::check() const { require_output(output); }

void RobotStateMessage::check() const {
  require_at_most("q", static_cast<std::size_t>(q.size()), most_joints);
  require_size("v", v.size(), q.size());
  require_size("torque", torque.size(), q.size());
  require_size("told_position", told_position.size(), q.size());
  require_size("told_velocity", told_velocity.size(), q.size());
  require_size("told_acceleration", told_acceleration.size(), q.size());
  if (lost_cycles < 0) {
    throw std::invalid_argument("lost_cycles is " + std::to_string(lost_cycles) + "; allowed: from 0");
  }
  if (mode > RobotMode::stopped) {
    throw std::invalid_argument("mode is " + std::to_string(static_cast<int>(mode)) + "; allowed: 0 to 3");
  }
}

void RobotCommandMessage::check() const {
  require_output(output);
  require_at_most("values", static_cast<std::size_t>(values.size()), most_joints);
  require_finite("values", values);
}

void RobotStop::check() const { require_text("words", words); }

void RobotObjects::check() const {
  require_at_most("names", names.size(), most_objects);
  for (const std::string& name : names) {
    require_text("names", name);
  }
  require_size("poses", poses.rows(), static_cast<Eigen::Index>(names.size()));
  require_size("poses[0]", poses.cols(), 7);
  require_finite("poses", poses);
}

}  // namespace sidestep::link
