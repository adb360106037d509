#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "sidestep/constraints/acceleration_bounds.hpp"

namespace sidestep {

/// @cond internal
/// How a solve ended, from best to worst. The command is safe to send after every one of them.
enum class ProgramStatus {
  ok,                      ///< The wanted acceleration is tracked, and no limit is in the way.
  limited,                 ///< Optimal within the limits, and at least one of them is in the way.
  relaxed,                 ///< limits of jerk, joint or Cartesian speed, or acceleration gave way to clearances,
                           ///< position or torque limits
  relaxed_safety,          ///< Not all clearances, position limits and overruns can be kept (see safety, slack).
  clearance_lost,          ///< The smallest clearance is below zero: in contact or inside, whatever the rest.
  fallback_invalid_input,  ///< The input is unusable (see fault): damped stop.
  fallback_solver,         ///< The quadratic program could not be solved: damped stop.
};

/// Unusable input of a solve.
enum class ProgramFault { none, position, velocity, acceleration, mass_matrix, bias, clearances };

/// Short names, for example "limited", "mass_matrix".
const char* name(ProgramStatus status) noexcept;
const char* name(ProgramFault fault) noexcept;
/// @endcond

/// Effect of one clearance on a solve.
struct SafetyRow {
  int coordinate;  ///< Coordinate of the clearance.
  int nearest;     ///< Its nearest obstacle point.
  /// Whether it asks for a stop along the path: −|∇h| v/|v| stands for ∇h below (see clearance_constraints.hpp).
  bool along_path;
  double required;    ///< Smallest ∇h·q̈ that was asked for [m/s²].
  double slack;       ///< Shortfall of the solution [m/s²]; 0 unless relaxed_safety.
  double multiplier;  ///< Cost of the row to the task, >= 0; the largest one dominates.
};

/// Result of a solve. Made once, written by every solve.
struct MotionSolution {
  explicit MotionSolution(int num_coordinates, int max_safety_rows = 32);

  ProgramStatus status = ProgramStatus::ok;
  ProgramFault fault = ProgramFault::none;
  Eigen::VectorXd torque;         ///< Torque [Nm | N], within the effort limits, always finite.
  Eigen::VectorXd acceleration;   ///< Acceleration M^-1 (torque - bias) [/s^2]; NaN where M or bias is unusable.
  Eigen::VectorXd slack;          ///< Acceleration beyond its bounds [/s^2], signed; 0 unless relaxed.
  Eigen::VectorXd lower, upper;   ///< Acceleration bounds used [/s^2]; NaN if q or v is unusable.
  std::vector<Limit> active;      ///< Limits that bind, of each joint.
  std::vector<SafetyRow> safety;  ///< Clearance rows, the first num_safety_rows, most critical first.
  int num_safety_rows = 0;
  int dominant = -1;         ///< Entry of `safety` that bends the motion most; -1: none.
  int speed_frame = -1;      ///< Frame whose speed limit bends the motion most; -1: none.
  double speed_slack = 0.0;  ///< Shortfall of its row [m/s²]; 0 unless speed limits gave way.
  /// Smallest clearance given [m], exact, also without a row; inf: none.
  double least_clearance = std::numeric_limits<double>::infinity();
  int least_coordinate = -1, least_nearest = -1;  ///< Its coordinate, and its nearest point; -1: none.
};

}  // namespace sidestep
