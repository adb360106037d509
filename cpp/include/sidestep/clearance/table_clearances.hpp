#pragma once

#include <vector>

#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/clearance/pair_distance_table.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Clearances that tables hold, one each: of links with two joints between them.
///
/// Such links are always close to each other, and ellipsoids too coarse: a table is exact, and faster.
///
/// What approaches is the tangent of h somewhere on the way that the arm takes to stop, τ ahead (see Horizon): that
/// which comes to the least, h + (τ − t) h' at the time t. So behind a crest the far slope counts before it is reached;
/// where h is convex the tangent is that of here. Where it is least h turns convex, or the arm has stopped, so that
/// what is less than 0 of its curvature is left out.
class TableClearances final : public ClearanceGroup {
 public:
  /// Throws std::invalid_argument, which `owner` begins, if there is no table; or if a link is unknown or a table at fault,
  /// which it names.
  TableClearances(const Robot& robot, std::vector<PairDistanceTable> tables, const char* owner);

  int size() const noexcept override { return static_cast<int>(tables_.size()); }
  CoordinateLabel label(int k) const override;
  void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                ClearanceView out) const noexcept override;
  double longest_activation(int k) const noexcept override { return activations_[static_cast<std::size_t>(k)]; }

  const PairDistanceTable& operator[](int k) const noexcept { return tables_[static_cast<std::size_t>(k)]; }

 private:
  std::vector<PairDistanceTable> tables_;
  std::vector<Eigen::Vector2d> steepest_;  // Steepest slopes of each table.
  std::vector<double> activations_;
};

}  // namespace sidestep
