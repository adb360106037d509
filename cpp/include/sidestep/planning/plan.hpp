#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

/// What a search says about its result.
enum class PlanStatus {
  found,               ///< there is a path
  no_path,             ///< none within the budget of nodes, iterations and checks
  timeout,             ///< none within the budget of time
  start_in_collision,  ///< see Plan::obstruction
  goal_in_collision,   ///< see Plan::obstruction
  invalid,             ///< start or goal is not finite, or outside the position limits by more than JointLimits::rounding
};

/// Short names, for example "goal_in_collision".
const char* name(PlanStatus status) noexcept;

/// What is in the way at an end of a motion.
struct Obstruction {
  CoordinateLabel label;  ///< kind, link, and the other link of a pair
  int point = -1;         ///< which obstacle point; -1 for a pair or a plane
  double depth = 0.0;     ///< how far the covering ellipsoids reach into each other or into the obstacle [m]
  std::string obstacle;   ///< what messages call the obstacle, see Obstacles::words_for; empty for a pair or a plane
};

/// For example "link 'hand' is 31 mm deep in 'table'", or "links 'hand' and 'forearm' touch, 12 mm deep".
std::string describe(const Obstruction& obstruction);

/// A path, or why there is none.
struct Plan {
  PlanStatus status = PlanStatus::invalid;
  Eigen::MatrixXd path;  ///< (nv × W) waypoints from start, or where a moving arm is then, to goal, straight between
  double margin = 0.0;   ///< [m] that it keeps, but for the ends, see Margins
  Obstruction obstruction;
  // The budget spent.
  int nodes = 0;  ///< of both trees
  int iterations = 0;
  std::int64_t checks = 0;           ///< see PlannerSettings; improvement included
  double search_seconds = 0.0;       ///< until a path was found
  double improvement_seconds = 0.0;  ///< to look for a wider one, and to make it short
};

/// Length of a path: Σ |Δq|, joints in radians and metres alike.
double length(const Eigen::MatrixXd& path) noexcept;

}  // namespace sidestep
