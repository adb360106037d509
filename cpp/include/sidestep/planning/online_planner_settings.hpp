#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sidestep/constraints/safety_settings.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/planning/rrt_connect.hpp"
#include "sidestep/planning/timed_path.hpp"
#include "sidestep/robot/dynamics.hpp"

namespace sidestep {

/// How an OnlinePlanner searches, and how its paths are followed.
struct OnlinePlannerSettings {
  PlannerSettings search = {};
  TimedPathSettings route = {};
  double period = 0.02;   ///< between two looks at the scene [s]
  double patience = 1.0;  ///< without progress until it plans again [s]
  double retry = 1.0;     ///< until a failed search is repeated in the same scene [s]
};
template <>
const std::vector<Field<OnlinePlannerSettings>>& fields();

/// What an OnlinePlanner is made for.
struct OnlinePlannerConfig {
  OnlinePlannerSettings planner = {};
  std::optional<RigidBodyDynamics> dynamics;  ///< of an arm that is moved by torque: paths are timed for its motors
  SafetySettings safety = {};  ///< of what follows: margin, rate and braking_fraction bound the speed near obstacles
  double tolerance = 0.05;     ///< it has arrived once every joint is this close to the goal [rad | m]
  double duration = std::numeric_limits<double>::infinity();  ///< allowed for a motion [s]
  std::uint64_t seed = 0;
  /// Plans in `step()`, at times given by the planner's period alone, so that a motion is the same every time; else in a thread.
  bool synchronous = false;
  /// Plans at all, where it is not synchronous. Without, the loop takes over what `give` hands it: for replays.
  bool works = true;

  /// Throws std::invalid_argument that names the setting at fault.
  void validate() const;
};

}  // namespace sidestep
