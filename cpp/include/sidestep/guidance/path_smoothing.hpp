#pragma once

#include <Eigen/Core>

#include "sidestep/guidance/body_clearance.hpp"
#include "sidestep/guidance/random_stream.hpp"

namespace sidestep {

/// Shortens a free path: waypoints that can be left out are, then `attempts` random pairs of points on it are joined by a
/// straight edge where that is free. What it returns is free with the same margins.
Eigen::MatrixXd shorten(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                        const Margins& margins, int attempts, RandomStream& random, BodyClearance::Workspace& workspace);

}  // namespace sidestep
