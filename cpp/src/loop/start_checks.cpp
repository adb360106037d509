#include "start_checks.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "short_number.hpp"
#include "sidestep/loop/loop.hpp"

namespace sidestep {
namespace {

constexpr double same_period = 0.01;  // Largest difference of two periods that count as the same, as a share.
// Share by which a limit of the controller may exceed the robot's: limits are written with few digits.
constexpr double same_limit = 1e-3;

std::string joined(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) {
    all += (all.empty() ? "" : ", ") + name;
  }
  return all;
}

/// Where a limit of the arm's model lets it do more than the robot; `sign`: -1 for lower bounds.
void check_limit(const char* what, const std::vector<std::string>& names, const Eigen::VectorXd& model,
                 const Eigen::VectorXd& robot, double slack, double sign = 1.0) {
  if (robot.size() == 0) {
    return;
  }
  if (robot.size() != model.size()) {
    throw std::invalid_argument(std::string("loop: the robot states ") + std::to_string(robot.size()) + " limits of " + what +
                                ", the arm has " + std::to_string(model.size()) + " joints");
  }
  for (Eigen::Index j = 0; j < model.size(); ++j) {
    if (sign * (model[j] - robot[j]) > slack + same_limit * std::abs(robot[j])) {
      throw std::invalid_argument("loop: joint '" + names[static_cast<std::size_t>(j)] + "': the " + what +
                                  " limit of the arm is " + short_number(model[j]) + ", the robot's is " +
                                  short_number(robot[j]) + "; give the arm the robot's limits");
    }
  }
}

}  // namespace

ControllerSettings::Output output_of(const Controller& controller) noexcept {
  using Output = ControllerSettings::Output;
  const Output output = controller.settings().output;
  return output != Output::automatic ? output : controller.has_torque() ? Output::torque : Output::acceleration;
}

void check_description(const RobotDescription& robot, const Controller& controller) {
  robot.validate();
  const Robot& arm = controller.arm().robot();
  const ControllerSettings::Output output = output_of(controller);
  if (std::find(robot.outputs.begin(), robot.outputs.end(), output) == robot.outputs.end()) {
    std::vector<std::string> taken;
    for (const ControllerSettings::Output one : robot.outputs) {
      taken.push_back(to_string(one));
    }
    throw std::invalid_argument("loop: robot '" + robot.name + "' takes " + joined(taken) + ", the controller's output is " +
                                to_string(output) + "; set ControllerSettings.output");
  }
  const double period = controller.settings().period;
  if (!(std::abs(period - robot.period) <= same_period * robot.period)) {
    throw std::invalid_argument("loop: the controller's period is " + short_number(period) + " s, that of robot '" +
                                robot.name + "' " + short_number(robot.period) + " s; set ControllerSettings.period");
  }
  if (!robot.joints.empty() && robot.joints != arm.coordinate_names()) {
    throw std::invalid_argument("loop: the joints of robot '" + robot.name + "' are " + joined(robot.joints) +
                                "; those of arm '" + arm.name() + "' " + joined(arm.coordinate_names()) +
                                "; they must be the same, in the same order");
  }
  const JointLimits& model = arm.limits();
  const auto& names = arm.coordinate_names();
  check_limit("lower position", names, model.lower, robot.limits.lower, JointLimits::rounding, -1.0);
  check_limit("upper position", names, model.upper, robot.limits.upper, JointLimits::rounding);
  check_limit("velocity", names, model.velocity, robot.limits.velocity, 0.0);
  if (output == ControllerSettings::Output::torque) {
    check_limit("effort", names, model.effort, robot.limits.effort, 0.0);
  }
}

void check_state(const RobotState& state, const Robot& arm) {
  const Eigen::Index nv = arm.num_coordinates();
  if (state.q.size() != nv || state.v.size() != nv) {
    throw std::runtime_error("loop: the robot's state has " + std::to_string(state.q.size()) + " positions and " +
                             std::to_string(state.v.size()) + " velocities, arm '" + arm.name() + "' has " +
                             std::to_string(nv) + " joints");
  }
  if (!state.has_dynamics() && (state.mass_matrix.size() > 0 || state.bias.size() > 0)) {
    throw std::runtime_error("loop: the robot's mass matrix is " + std::to_string(state.mass_matrix.rows()) + " x " +
                             std::to_string(state.mass_matrix.cols()) + ", its bias has " + std::to_string(state.bias.size()) +
                             " entries; arm '" + arm.name() + "' has " + std::to_string(nv) + " joints");
  }
  const JointLimits& limits = arm.limits();
  for (Eigen::Index j = 0; j < nv; ++j) {
    const std::string joint = "loop: joint '" + arm.coordinate_names()[static_cast<std::size_t>(j)] + "'";
    if (!std::isfinite(state.q[j]) || !std::isfinite(state.v[j])) {
      throw std::runtime_error(joint + ": the robot's first state is not finite; is it switched on and ready?");
    }
    if (state.q[j] < limits.lower[j] - JointLimits::rounding || state.q[j] > limits.upper[j] + JointLimits::rounding) {
      throw std::runtime_error(joint + " is at " + short_number(state.q[j]) + ", outside its limits " +
                               short_number(limits.lower[j]) + " to " + short_number(limits.upper[j]) +
                               "; move it inside, by hand or by the robot's own means");
    }
    if (std::abs(state.v[j]) > limits.velocity[j]) {
      throw std::runtime_error(joint + " moves at " + short_number(state.v[j]) + ", beyond its velocity limit " +
                               short_number(limits.velocity[j]) + "; are the units right?");
    }
  }
}

}  // namespace sidestep
