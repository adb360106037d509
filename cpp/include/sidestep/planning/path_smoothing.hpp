#pragma once

#include <Eigen/Core>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/math/random_stream.hpp"
#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// Shortens a free path: waypoints that can be left out are, then at most `attempts` random stretches of it are
/// replaced by a straight edge, or by the same with one joint at a constant rate (Geraerts and Overmars 2007), where
/// that is shorter and free; a third of the attempts in vain ends it, or an interruption. What it returns is free with
/// the same margins.
Eigen::MatrixXd shorten(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                        const Margins& margins, int attempts, RandomStream& random, ClearanceQuery::Workspace& workspace,
                        const Interrupted& interrupted = never_interrupted);

/// Shifts the waypoints of a free path where the edges to either side then take less time, at speeds proportional to
/// the clearance below `wide` [m], a quarter at least; ends stay. What it returns is free with the same margins.
Eigen::MatrixXd widen(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                      const Margins& margins, double wide, RandomStream& random, ClearanceQuery::Workspace& workspace,
                      const Interrupted& interrupted = never_interrupted);

}  // namespace sidestep
