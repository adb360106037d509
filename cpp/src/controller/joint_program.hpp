#pragma once

#include "arm_dynamics.hpp"
#include "sidestep/constraints/motion_program.hpp"
#include "sidestep/controller/settings.hpp"
#include "tick.hpp"

namespace sidestep {

/// Less than the limits by what is left for noise, delay, rounding and what the model lacks; velocities of `speed` times theirs.
Robot within_margins(const Robot& robot, const ControllerSettings& settings, double speed);

/// Periods for the program of a step.
inline MotionPeriods periods_of(const Tick& tick) noexcept {
  return {tick.period, tick.torque_period(), tick.speed_share(), tick.inside()};
}

/// The quadratic program for torque, or for acceleration where the arm is not moved by torque.
class JointProgram {
 public:
  JointProgram(const Robot& within_margins, const ControllerSettings& settings, bool torque);

  /// The acceleration nearest to the wanted one at q, v, with the dynamics there.
  [[nodiscard]] ProgramStatus solve(ConstVectorRef q, ConstVectorRef v, const Eigen::VectorXd& wanted,
                                    const ArmDynamics& dynamics, const Clearances* clearances, const SecondState& second,
                                    const LastCommand& last, const Tick& tick, MotionSolution& solution,
                                    const SpeedLimitNow& speed = {}) noexcept {
    return program_.solve({q, v, wanted, dynamics.mass(), dynamics.bias(), clearances, second, last, speed, periods_of(tick)},
                          solution);
  }
  /// A damped stop of an arm whose state may be unusable, with the dynamics told where they are.
  [[nodiscard]] ProgramStatus stop(ConstVectorRef q, ConstVectorRef v, const Eigen::VectorXd& wanted, const ToldDynamics& told,
                                   const ArmDynamics& dynamics, const Eigen::VectorXd* last_torque, const Tick& tick,
                                   MotionSolution& solution) noexcept;
  /// Share of the jerk limits with which torques keep their rate.
  double jerk_share(const Tick& tick) const noexcept {
    return program_.settings().by_torque ? program_.jerk_share(periods_of(tick)) : 1.0;
  }

 private:
  MotionProgram program_;
};

/// What the program is to stay near: the last acceleration, and the last torque where there was one. `factor`: up to which the
/// acceleration may exceed its limits; `binds`: jerk does.
LastCommand near_last(const Eigen::VectorXd& acceleration, const Eigen::VectorXd* torque, const ArmDynamics& dynamics,
                      double factor, bool binds) noexcept;

}  // namespace sidestep
