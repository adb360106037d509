#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

/// Result of a search.
enum class PlanStatus {
  found,               ///< There is a path.
  no_path,             ///< No path within the budget of nodes, iterations and checks.
  timeout,             ///< No path within the budget of time.
  start_in_collision,  ///< The start is in collision, see Plan::obstruction.
  goal_in_collision,   ///< The goal is in collision, see Plan::obstruction.
  invalid,             ///< Start or goal is not finite, or outside the position limits by more than JointLimits::rounding.
};

/// Short names, for example "goal_in_collision".
const char* name(PlanStatus status) noexcept;

/// Obstruction at an end of a motion.
struct Obstruction {
  CoordinateLabel label;  ///< Kind, link, and the other link of a pair.
  int point = -1;         ///< Index of the obstacle point; -1 for a pair or a plane.
  double depth = 0.0;     ///< Depth of the covering ellipsoids in each other or in the obstacle [m].
  std::string obstacle;   ///< Name of the obstacle in messages, see Obstacles::words_for; empty for a pair or a plane.
};

/// For example "link 'hand' is 31 mm deep in 'table'", or "links 'hand' and 'forearm' touch, 12 mm deep".
std::string describe(const Obstruction& obstruction);

/// A path, or why there is none.
struct Plan {
  PlanStatus status = PlanStatus::invalid;
  /// Waypoints (nv × W) from the start, or from where a moving arm is then, to the goal, straight in between.
  Eigen::MatrixXd path;
  double margin = 0.0;  ///< Margin that the path keeps [m], except near its ends, see Margins.
  Obstruction obstruction;
  // The budget spent.
  int nodes = 0;  ///< Nodes of both trees.
  int iterations = 0;
  std::int64_t checks = 0;           ///< Checks, see PlannerSettings; improvement included.
  double search_seconds = 0.0;       ///< Time until a path was found [s].
  double improvement_seconds = 0.0;  ///< Time to search a wider path and to shorten it [s].
};

/// Length of a path: Σ |Δq|, joints in radians and metres alike.
double length(const Eigen::MatrixXd& path) noexcept;

}  // namespace sidestep
