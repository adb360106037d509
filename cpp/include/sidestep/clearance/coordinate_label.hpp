#pragma once

#include <limits>
#include <string>

namespace sidestep {

/// Label of a clearance, or of another coordinate of an embedding. Fixed at construction.
struct CoordinateLabel {
  enum class Kind {
    potential,    ///< No clearance: a density, a sum.
    obstacle,     ///< A link, or one ellipsoid of it, against the obstacle points.
    self,         ///< Two links of the robot.
    plane,        ///< A link against a plane.
    joint_limit,  ///< A joint against a position limit; the clearance is in the joint's unit.
    effort,       ///< The gravity torque of a joint against its effort limit, see GravityTorqueLimit.
  };
  Kind kind = Kind::potential;
  std::string name = {};                                    ///< Name of the link, or of the coordinate for limits.
  std::string other = {};                                   ///< Second link of a pair; "lower" or "upper" for a joint limit.
  double floor = -std::numeric_limits<double>::infinity();  ///< Clearance below which the arm counts as inside.
  bool prismatic = false;  ///< Whether it is a limit of a prismatic joint: the clearance is in m, not in rad.
};

}  // namespace sidestep
