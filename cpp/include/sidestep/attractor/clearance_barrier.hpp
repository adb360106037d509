#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sidestep/attractor/barrier.hpp"
#include "sidestep/clearance/clearance_field.hpp"
#include "sidestep/clearance/gravity_torque_limit.hpp"
#include "sidestep/clearance/pair_clearances.hpp"
#include "sidestep/clearance/plane_clearances.hpp"
#include "sidestep/clearance/table_clearances.hpp"

namespace sidestep {

/// One coordinate per clearance of a group, a barrier of it:
///
///     ψ_k = strength (activation / h_k − 1)^power for h_k < activation, else 0.
///
/// The metric I + JᵀJ is then complete on the free set: kinetic energy bounds dψ/dt, so in continuous time ψ cannot
/// become infinite and what has clearances cannot touch. Moving obstacles enter dψ/dt and d²ψ/dt² exactly.
class ClearanceBarrier : public Barrier {
 public:
  /// Measures clearances up to `reach` [m], at least to the activation distance, and critical samples as far as the arm needs
  /// to stop, for the MotionProgram. Throws std::invalid_argument that names the setting at fault.
  ClearanceBarrier(const Robot& robot, std::shared_ptr<const ClearanceGroup> group, const BarrierFunction& function,
                   double reach = 0.0, const char* owner = "clearance barrier");

  /// Of the body's ellipsoids to obstacles, see ClearanceField for temperature [m] and window. The body must be calibrated.
  ClearanceBarrier(const Robot& robot, const Body& body, const BarrierFunction& function, double temperature = 0.002,
                   double reach = 0.0, double window = ClearanceField::default_window);

  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;

  bool touches(const KinematicState& state, const Obstacles& obstacles, double depth) const noexcept override {
    return group_->touches(state, obstacles, depth);
  }
  CoordinateLabel label(int k) const override;

  const ClearanceGroup& group() const noexcept { return *group_; }
  double reach() const noexcept { return reach_; }

 private:
  bool is_seen() const noexcept override { return group_->is_seen(); }

  std::shared_ptr<const ClearanceGroup> group_;
  double reach_;
};

/// Of pairs of links that must not touch, see PairClearances.
class SelfCollisionBarrier final : public ClearanceBarrier {
 public:
  SelfCollisionBarrier(const Robot& robot, const Body& body, const std::vector<LinkPair>& pairs,
                       const BarrierFunction& function, double temperature = PairClearances::default_temperature,
                       double reach = 0.0);
};

/// Of pairs of links whose clearances tables hold, see TableClearances.
class PairDistanceTableBarrier final : public ClearanceBarrier {
 public:
  PairDistanceTableBarrier(const Robot& robot, std::vector<PairDistanceTable> tables, const BarrierFunction& function,
                           double reach = 0.0);
};

/// Of links to a plane that must not be crossed, see PlaneClearances.
class PlaneBarrier final : public ClearanceBarrier {
 public:
  PlaneBarrier(const Robot& robot, const Body& body, const KeptPlane& plane, const BarrierFunction& function,
               double temperature = PairClearances::default_temperature, double reach = 0.0);
};

}  // namespace sidestep
