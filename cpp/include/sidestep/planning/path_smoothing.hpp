#pragma once

#include <Eigen/Core>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/math/random_stream.hpp"
#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// Shortens a free path. It drops waypoints that can be left out, then replaces up to `attempts` random stretches by a straight
/// edge, or by the same with one joint at a constant rate (Geraerts and Overmars 2007), if that is shorter and free. It ends
/// after a third of the attempts in a row without success, or by an interruption. The result is free with the same margins.
Eigen::MatrixXd shorten(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                        const Margins& margins, int attempts, RandomStream& random, ClearanceQuery::Workspace& workspace,
                        const Interrupted& interrupted = never_interrupted);

/// Shifts the waypoints of a free path so that its edges take less time, at speeds proportional to the clearance below `wide`
/// [m], at least a quarter; the ends stay. The result is free with the same margins.
Eigen::MatrixXd widen(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                      const Margins& margins, double wide, RandomStream& random, ClearanceQuery::Workspace& workspace,
                      const Interrupted& interrupted = never_interrupted);

}  // namespace sidestep
