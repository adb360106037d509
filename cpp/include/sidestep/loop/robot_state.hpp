#pragma once

#include <Eigen/Core>
#include <limits>

namespace sidestep {

/// What a robot says of itself in one cycle.
struct RobotState {
  explicit RobotState(int num_coordinates);

  /// When it was measured [s]: on the machine's monotonic clock, or on the model's clock of a simulation; NaN: the robot does not say.
  double time = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd q, v;    ///< (nv) measured [rad | m], [rad/s | m/s]
  Eigen::VectorXd torque;  ///< (nv) measured, gravity included [Nm | N]; NaN: the robot does not say
  /// (nv) What the robot goes on from, if it interpolates what it is sent [rad | m], [/s], [/s²]; NaN: the robot does not say.
  Eigen::VectorXd told_position, told_velocity, told_acceleration;
  /// Of the robot's own dynamics at q and v: (nv, nv) mass matrix, (nv) bias [Nm | N]. Empty: it does not say, and the arm's count.
  Eigen::MatrixXd mass_matrix;
  Eigen::VectorXd bias;
  bool is_lost = false;  ///< no new state came: what stands here is the last one
  int lost_cycles = 0;   ///< cycles since the state before in which the robot went on without a command

  /// Whether the robot says what it goes on from.
  bool is_told() const noexcept { return told_velocity.allFinite() && told_acceleration.allFinite(); }
  bool has_dynamics() const noexcept {
    return mass_matrix.rows() == q.size() && mass_matrix.cols() == q.size() && bias.size() == q.size();
  }
};

}  // namespace sidestep
