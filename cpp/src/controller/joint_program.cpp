#include "joint_program.hpp"

namespace sidestep {
namespace {

MotionProgramSettings program_settings(const ControllerSettings& settings, bool torque) {
  MotionProgramSettings program;
  program.period = settings.period;
  program.by_torque = torque;
  program.safety = settings.safety;
  program.limits_speed = settings.speed_limits.has_value();
  program.position_margin = settings.position_margin;
  program.stop_time = settings.stop_time;
  if (torque) {
    program.stop_damping = settings.stop_damping;
    program.torque_weight.setConstant(settings.torque_weight);
    program.slack_weight = settings.slack_weight;
    program.velocity_overrun = settings.velocity_overrun;
    program.acceleration_overrun = settings.acceleration_overrun;
  }
  return program;
}

}  // namespace

Robot within_margins(const Robot& robot, const ControllerSettings& settings, double speed) {
  JointLimits limits = robot.limits();
  const double left = 1.0 - settings.limit_margin;
  limits.velocity *= left * speed;
  limits.acceleration *= left;
  limits.jerk *= left;
  limits.effort_rate *= left;
  limits.effort *= 1.0 - settings.effort_margin;
  return Robot(robot.name(), robot.joints(), robot.frames(), robot.coordinate_names(), std::move(limits));
}

JointProgram::JointProgram(const Robot& robot, const ControllerSettings& settings, bool torque)
    : program_(robot, program_settings(settings, torque)) {}

ProgramStatus JointProgram::stop(ConstVectorRef q, ConstVectorRef v, const Eigen::VectorXd& wanted, const ToldDynamics& told,
                                 const ArmDynamics& dynamics, const Eigen::VectorXd* last_torque, const Tick& tick,
                                 MotionSolution& solution) noexcept {
  const LastCommand last{nullptr, program_.settings().by_torque ? last_torque : nullptr};
  const bool usable = told.mass_matrix != nullptr && told.bias->size() == dynamics.bias().size() && told.bias->allFinite();
  const MotionPeriods periods = periods_of(tick);
  return usable ? program_.solve({q, v, wanted, *told.mass_matrix, *told.bias, nullptr, {}, last, {}, periods}, solution)
                : program_.solve({q, v, wanted, dynamics.mass(), dynamics.bias(), nullptr, {}, last, {}, periods}, solution);
}

LastCommand near_last(const Eigen::VectorXd& acceleration, const Eigen::VectorXd* torque, const ArmDynamics& dynamics,
                      double factor, bool binds) noexcept {
  return {&acceleration,
          torque,
          dynamics.has_model() ? &dynamics.gravity() : nullptr,
          dynamics.has_model() ? &dynamics.gravity_change() : nullptr,
          factor,
          binds};
}

}  // namespace sidestep
