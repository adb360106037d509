#pragma once

#include <string>

#include "inputs_stage.hpp"
#include "model.hpp"
#include "sidestep/controller/command.hpp"

namespace sidestep {

/// What of a velocity, twist or trajectory that is followed the command is, and why not all of it. `bound`: the coordinate that bends
/// it most, in the program or by barriers; -1: none. `clearances`: at the reference. Allocates.
std::string explain_input(const ControllerModel& model, const InputsStage& inputs, const Command& command,
                          const Eigen::VectorXd& next_v, Eigen::Index bent_by, const Clearances& clearances,
                          const Obstacles& obstacles);

}  // namespace sidestep
