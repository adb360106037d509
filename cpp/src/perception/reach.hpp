#pragma once

#include <Eigen/Core>

#include "sidestep/arm/arm.hpp"

namespace sidestep {

/// Where an arm can be: within a ball around its first joint.
struct Reach {
  Eigen::Vector3d centre;  ///< [m] in the world
  double radius;           ///< how far its ellipsoids get [m], about: of random configurations, and a little more
};

Reach reach_of(const Arm& arm);

}  // namespace sidestep
