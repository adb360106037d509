#pragma once

#include <limits>
#include <string>

namespace sidestep {

/// What a clearance, or another coordinate of an embedding, is of. Fixed at construction, for messages and for what acts on clearances.
struct CoordinateLabel {
  enum class Kind {
    potential,    ///< no clearance: a density, a sum
    obstacle,     ///< a link, or one ellipsoid of it, against the obstacle points
    self,         ///< two links of the robot
    plane,        ///< a link against a plane
    joint_limit,  ///< a joint against a position limit; the clearance is in the joint's unit
    effort,       ///< what a joint holds of the arm against its effort limit, see GravityTorqueLimit
  };
  Kind kind = Kind::potential;
  std::string name = {};                                    ///< Name of the link, or of the coordinate for limits.
  std::string other = {};                                   ///< Second link of a pair; "lower" or "upper" for a joint limit.
  double floor = -std::numeric_limits<double>::infinity();  ///< Clearance below which the arm counts as inside.
  bool prismatic = false;  ///< Whether it is a limit of a prismatic joint: the clearance is in m, not in rad.
};

}  // namespace sidestep
