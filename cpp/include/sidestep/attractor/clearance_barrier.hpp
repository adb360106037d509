#pragma once

#include <string>
#include <vector>

#include "sidestep/attractor/barrier.hpp"
#include "sidestep/clearance/clearance_field.hpp"

namespace sidestep {

/// One coordinate per body ellipsoid, a barrier of its clearance to the obstacles:
///
///     ψ_k = strength (activation / h_k − 1)^power for h_k < activation, else 0.
///
/// The metric I + JᵀJ is then complete on the free set: kinetic energy bounds dψ/dt, so in continuous time ψ cannot
/// become infinite and the ellipsoids cannot touch. Moving obstacles enter dψ/dt and d²ψ/dt² exactly.
class ClearanceBarrier final : public Barrier {
 public:
  /// The body must be calibrated. Clearances are measured up to `reach` [m], at least to the activation distance, and
  /// what approaches as far as the arm needs to stop, for what keeps them (TorqueController, AccelerationFilter). For
  /// temperature [m] and window see ClearanceField.
  /// Throws std::invalid_argument that names what is wrong.
  ClearanceBarrier(const Robot& robot, const Body& body, BarrierFunction barrier, double temperature = 0.002,
                   double reach = 0.0, double window = ClearanceField::default_window);

  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;

  bool touches(const KinematicState& state, const Obstacles& obstacles, double depth) const noexcept override {
    return field_.touches(state, obstacles, depth);
  }
  CoordinateLabel label(int k) const override;

  const ClearanceField& field() const noexcept { return field_; }
  double reach() const noexcept { return reach_; }

 private:
  bool is_seen() const noexcept override { return true; }

  ClearanceField field_;
  double reach_;
  std::vector<std::string> links_;  // of the body's components
};

}  // namespace sidestep
