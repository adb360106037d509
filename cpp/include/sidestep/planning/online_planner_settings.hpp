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

/// Settings of an OnlinePlanner: search, and following of paths.
struct OnlinePlannerSettings {
  PlannerSettings search = {};
  TimedPathSettings route = {};
  double period = 0.02;   ///< Time between two checks of the scene [s].
  double patience = 1.0;  ///< Time without progress until it plans again [s].
  double retry = 1.0;     ///< Time until a failed search is repeated in the same scene [s].
};
template <>
const std::vector<Field<OnlinePlannerSettings>>& fields();

/// Configuration of an OnlinePlanner.
struct OnlinePlannerConfig {
  OnlinePlannerSettings planner = {};
  std::optional<RigidBodyDynamics> dynamics;  ///< Dynamics of an arm that is moved by torque: paths are timed for its motors.
  /// Clearance settings of the controller: margin, rate and braking_fraction bound the speed near obstacles.
  SafetySettings safety = {};
  double tolerance = 0.05;                                    ///< Largest joint error at the goal [rad | m].
  double duration = std::numeric_limits<double>::infinity();  ///< Longest duration of a motion [s].
  std::uint64_t seed = 0;
  /// Whether it plans in `step()`, at times given by the planner's period alone, so that a motion is the same every time;
  /// otherwise in a thread.
  bool synchronous = false;
  /// Whether it plans at all, if not synchronous. Without, the loop takes over what `give` hands it: for replays.
  bool works = true;

  /// Throws std::invalid_argument that names the setting at fault.
  void validate() const;
};

}  // namespace sidestep
