#include "sidestep/loop/robot_state.hpp"

namespace sidestep {

RobotState::RobotState(int num_coordinates)
    : q(Eigen::VectorXd::Zero(num_coordinates)),
      v(q),
      torque(Eigen::VectorXd::Constant(num_coordinates, std::numeric_limits<double>::quiet_NaN())),
      told_position(torque),
      told_velocity(torque),
      told_acceleration(torque) {}

}  // namespace sidestep
