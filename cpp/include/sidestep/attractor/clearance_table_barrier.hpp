#pragma once

#include <vector>

#include "sidestep/attractor/barrier.hpp"
#include "sidestep/clearance/clearance_table.hpp"

namespace sidestep {

/// One coordinate per table, a barrier of the clearance it holds: self-collision of links with two joints between them.
///
/// Such links are always close to each other, and ellipsoids too coarse: a table is exact, and faster.
///
/// What approaches is the tangent of h somewhere on the way that the arm takes to stop, τ ahead (see Horizon): that
/// which comes to the least, h + (τ − t) h' at the time t. So behind a crest the far slope counts before it is reached;
/// where h is convex the tangent is that of here. Where it is least h turns convex, or the arm has stopped, so that
/// what is less than 0 of its curvature is left out.
class ClearanceTableBarrier final : public Barrier {
 public:
  /// Clearances are given up to `reach` [m], at least to the activation distance, as in ClearanceBarrier. Throws
  /// std::invalid_argument if there is no table, a link is unknown, or a table or a setting is at fault, which it
  /// names.
  ClearanceTableBarrier(const Robot& robot, std::vector<ClearanceTable> tables, BarrierFunction barrier, double reach = 0.0);

  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;
  CoordinateLabel label(int k) const override;

 private:
  double reach_;
  std::vector<ClearanceTable> tables_;
  std::vector<Eigen::Vector2d> steepest_;  // of each
};

}  // namespace sidestep
