#pragma once

#include <Eigen/Core>
#include <utility>

#include "../../src/controller/closing_estimate.hpp"
#include "../../src/controller/model.hpp"
#include "../../src/controller/reference.hpp"
#include "../../src/controller/source_registry.hpp"
#include "support/covered_arm.hpp"
#include "support/repeatable_settings.hpp"

namespace sidestep::test {

/// Everything in the step's own thread; without planner, look-ahead and sub-goals: what leads straight to its goal.
inline ControllerSettings straight_settings(ControllerSettings::Output output) {
  ControllerSettings settings = repeatable_settings(output);
  settings.planner.reset();
  settings.look_ahead.reset();
  settings.local_minimum.reset();
  return settings;
}

/// What the stages of a controller are made from: for a covered arm of so many joints, jerk at most 1000 rad/s³.
inline ControllerModel stage_model(int num_joints, ControllerSettings settings) {
  JointLimits limits = arm_limits(num_joints);
  limits.jerk.setConstant(1000.0);
  return ControllerModel(covered_arm(std::move(limits)), std::move(settings));
}

/// Nothing closes beside the velocities that were told.
inline ClosingEstimate no_closing(const ControllerModel& model) {
  return ClosingEstimate(model.arm.robot(), model.arm.body(), model.body.items().obstacles(), model.settings.safety.margin);
}

/// A reference at q, v, also at the end of its period.
inline Reference reference_at(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  Reference reference(q.size());
  reference.q = reference.next_q = q;
  reference.v = reference.next_v = v;
  return reference;
}

/// A world of one source, "scene", which is valid for ever.
inline std::shared_ptr<const World> world_of(Obstacles obstacles, std::uint64_t number = 1) {
  World world{number, obstacles, {}};
  world.sources.push_back({"scene", 1, number, SourceOptions::untold, SourceOptions::untold, number, for_ever.valid_for,
                           for_ever.valid_for, false, false, std::make_shared<const Obstacles>(obstacles)});
  return std::make_shared<const World>(std::move(world));
}

}  // namespace sidestep::test
