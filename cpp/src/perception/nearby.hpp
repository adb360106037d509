#pragma once

#include <Eigen/Core>

#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Distance from a point to the nearest ball of obstacles [m], negative inside; `beyond` where there is none nearer. No allocation.
double distance_to(const Obstacles& obstacles, const Eigen::Vector3d& point, double beyond) noexcept;

}  // namespace sidestep
