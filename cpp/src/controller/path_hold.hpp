#pragma once

#include <Eigen/Core>

#include "sidestep/attractor/goal.hpp"
#include "sidestep/controller/joint_trajectory.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/planning/look_ahead.hpp"
#include "sidestep/planning/online_planner.hpp"

namespace sidestep {

/// Adds to a goal's acceleration what its attraction K e + D ė lacks of the critical spring ω² e + 2 ω ė that follows a path, which
/// is stiffer than one that approaches a goal. At q, v (nv).
void hold_to_path(const ControllerSettings& settings, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                  JointGoal& goal) noexcept;

/// Moves a goal along a trajectory whose clock is at `clock` [s] and runs at `rate`. Allocates. `settings` stay.
LookAhead::Leader leader_along(const ControllerSettings& settings, JointTrajectory path, double clock, double rate);
/// The same along the path that a planner is followed on; none where there is a newer one.
LookAhead::Leader leader_along(const ControllerSettings& settings, const OnlinePlanner& planner,
                               const OnlinePlanner::Following& following);

}  // namespace sidestep
