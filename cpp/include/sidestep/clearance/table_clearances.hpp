#pragma once

#include <vector>

#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/clearance/pair_distance_table.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Clearances of links with two joints in between, one table each.
///
/// Such links are always close, and ellipsoids are too coarse for them. A table is exact, and faster.
///
/// The critical sample is a tangent of h on the way that the arm takes to stop, τ ahead (see Horizon): the one with the
/// smallest h + (τ − t) h' at a time t. So behind a crest the far slope counts before it is reached; where h is convex, it is
/// the present tangent. At the minimum h turns convex or the arm has stopped, so a negative curvature is left out.
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
