#pragma once

#include <string>

#include "sidestep/controller/controller.hpp"
#include "sidestep/link/obstacle_messages.hpp"
#include "sidestep/link/request_messages.hpp"

namespace sidestep::link {

// What requests do to a controller. Each throws std::invalid_argument in the controller's words, and returns what is hard to believe in
// the request, see Controller::questions; empty: nothing.
std::string apply(Controller& controller, const SetJointGoal& request);
std::string apply(Controller& controller, const SetPoseGoal& request);
std::string apply(Controller& controller, const SetVelocity& request);
std::string apply(Controller& controller, const SetTwist& request);
std::string apply(Controller& controller, const SetTrajectory& request);
std::string apply(Controller& controller, const ClearGoal& request);
std::string apply(Controller& controller, const Restart& request);
std::string apply(Controller& controller, const SetObstacles& request);
std::string apply(Controller& controller, const AddObstacle& request);
std::string apply(Controller& controller, const MoveObstacle& request);
std::string apply(Controller& controller, const RemoveObstacle& request);
std::string apply(Controller& controller, const RemoveObstacles& request);
std::string apply(Controller& controller, const ExpectObstacles& request);

/// The message that asks for a goal.
SetPoseGoal pose_request(const PoseGoal& goal);

}  // namespace sidestep::link
