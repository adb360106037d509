#pragma once

#include "sidestep/controller/controller.hpp"
#include "sidestep/loop/driver.hpp"

namespace sidestep {

/// Throws std::invalid_argument that names what of the robot does not fit the controller: output, period, joints, limits.
void check_description(const RobotDescription& robot, const Controller& controller);
/// Throws std::runtime_error that names the joint, its value and what is allowed, where a state is not one of this arm.
void check_state(const RobotState& state, const Robot& arm);

}  // namespace sidestep
