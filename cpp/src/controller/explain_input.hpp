#pragma once

#include <string>

#include "attractor_stage.hpp"
#include "inputs_stage.hpp"
#include "model.hpp"
#include "sidestep/controller/command.hpp"

namespace sidestep {

/// How much of the velocity, twist or trajectory that is followed the command is, and what keeps it from being all of it. `next_v`:
/// velocity of the reference after this period. Allocates.
std::string explain_input(const ControllerModel& model, const InputsStage& inputs, const AttractorStage& attractor,
                          const Command& command, const Eigen::VectorXd& next_v, const Obstacles& obstacles);

}  // namespace sidestep
