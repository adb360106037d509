#pragma once

#include <optional>
#include <string>

#include "attractor_stage.hpp"
#include "inputs_stage.hpp"
#include "sources.hpp"
#include "measured_state.hpp"
#include "model.hpp"
#include "request_board.hpp"
#include "sources.hpp"

namespace sidestep {

// Why the arm is not at its goal, in words. All of it allocates.

/// What the covering body touches at the goal that was set, or at the posture found for it; nothing where that is free.
std::optional<Obstruction> obstruction_at_goal(const RequestBoard& board, const ClearanceQuery& body);
/// What is in the way at the target, as deep as the covering body says; empty where nothing is.
std::string explain_target(const ControllerModel& model, const RequestBoard& board, const InputsStage& inputs,
                           const Sources& sources);
/// What is in the way where the arm is, and what to do about it.
std::string explain_start(const Robot& robot, const Obstruction& here);
/// How far the nearest posture is from a pose that is out of reach; empty where none was found.
std::string explain_reach(const RequestBoard& board);
/// Why the last step moved as it did; how far the goal is counts from the arm to the goal that was set, wherever a path or a sub-goal
/// leads first.
Diagnosis diagnosis(const AttractorStage& attractor, const InputsStage& inputs, const MeasuredState& arm,
                    const KinematicState& at_arm, const JointKinds& joints);
/// What it gives way to though nobody told its velocity; empty where there is nothing.
std::string explain_closing(const Sources& sources, const Clearances& clearances, const std::vector<Eigen::Index>& in_metres);
/// That the age of the look-ahead slows the arm to `pace`.
std::string explain_age(double pace, double age);

}  // namespace sidestep
