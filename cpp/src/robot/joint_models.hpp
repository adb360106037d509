#pragma once

#include <vector>

#include "kernels/kinematics_kernel.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// The joints of a robot as the inner loops read them, filled up to whole blocks.
std::vector<kernels::JointModel> joint_models(const Robot& robot);

}  // namespace sidestep
