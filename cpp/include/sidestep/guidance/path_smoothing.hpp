#pragma once

#include <Eigen/Core>

#include "sidestep/guidance/body_clearance.hpp"
#include "sidestep/guidance/random_stream.hpp"

namespace sidestep {

/// Shortens a free path: waypoints that can be left out are, then `attempts` random pairs of points on it are joined by a
/// straight edge where that is free. What it returns is free with the same margins.
Eigen::MatrixXd shorten(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                        const Margins& margins, int attempts, RandomStream& random, BodyClearance::Workspace& workspace);

/// Shifts the waypoints of a free path away from what is near, as long as they gain clearance, up to `wide` [m], on the edges
/// to either side; ends stay. What it returns is free with the same margins.
Eigen::MatrixXd widen(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                      const Margins& margins, double wide, RandomStream& random, BodyClearance::Workspace& workspace);

}  // namespace sidestep
