#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "input.hpp"
#include "joint_kinds.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/controller/plausibility.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/arm/arm.hpp"

namespace sidestep {

/// What the stages of a controller are made from. Nothing in it changes.
struct ControllerModel {
  /// Throws std::invalid_argument where settings or arm do not fit.
  ControllerModel(Arm arm, ControllerSettings settings);

  const Arm arm;
  const ControllerSettings settings;
  const bool torque;                                ///< it is what the arm is moved by
  const std::optional<RigidBodyDynamics> dynamics;  ///< with torque, where the arm has inertias
  const ClearanceQuery body;                        ///< its items are those of the system's barriers
  const std::shared_ptr<const GeometricSystem> system;
  const Plausibility plausible;
  const JointKinds joints;
  const UsableLimits usable;
  const std::vector<Eigen::Index> clearances;  ///< coordinates in metres: of obstacles, planes and links
  const double look_period;                    ///< [s] of looks for the worker
};

}  // namespace sidestep
