#pragma once

#include "sidestep/constraints/torque_controller.hpp"

namespace sidestep {

struct AccelerationFilterSettings {
  double period = 0.001;         ///< time for which the acceleration is held [s]
  double position_margin = 0.0;  ///< position limits are moved inwards by this much [rad | m]
  double stop_time = 0.1;        ///< time constant of the damped stop q̈ = -v/stop_time [s]
  SafetySettings safety = {};
  int max_speed_rows = 0;  ///< see TorqueControllerSettings
};

/// The acceleration nearest to a wanted one within the limits of joints and clearances, for motion without torque:
/// TorqueController with unit masses and unlimited effort. Position, velocity and acceleration limits are then what the
/// actuators can do: they are never left, and only clearances can give way to them (status
/// relaxed_safety, clearance_lost where one is below zero).
class AccelerationFilter {
 public:
  /// Throws std::invalid_argument if the settings are not valid.
  explicit AccelerationFilter(const Robot& robot, AccelerationFilterSettings settings = {});

  /// Writes `solution`, of which `acceleration` is the result; always finite. Clearances: none if null. No allocation.
  [[nodiscard]] TorqueStatus apply(ConstVectorRef q, ConstVectorRef v, ConstVectorRef acceleration,
                                   const Clearances* clearances, TorqueSolution& solution) noexcept {
    return apply(q, v, acceleration, clearances, {}, {}, solution);
  }

  /// The same near the last command, with the clearances at another state and limits of Cartesian speed.
  [[nodiscard]] TorqueStatus apply(ConstVectorRef q, ConstVectorRef v, ConstVectorRef acceleration,
                                   const Clearances* clearances, const SecondState& second, const LastCommand& last,
                                   TorqueSolution& solution, const SpeedRows* speed = nullptr) noexcept {
    return controller_.solve(q, v, acceleration, unit_mass_, no_bias_, clearances, second, last, solution, speed);
  }

  double period() const noexcept { return controller_.settings().period; }
  int num_coordinates() const noexcept { return controller_.num_coordinates(); }
  int max_safety_rows() const noexcept { return controller_.settings().safety.max_rows; }
  std::int64_t count(TorqueStatus status) const noexcept { return controller_.count(status); }
  const QuadraticProgramData& program() const noexcept { return controller_.program(); }  ///< see TorqueController

 private:
  Eigen::MatrixXd unit_mass_;
  Eigen::VectorXd no_bias_;
  TorqueController controller_;
};

}  // namespace sidestep
