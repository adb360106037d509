#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/clearance/clearances.hpp"
#include "sidestep/clearance/coordinate_label.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Output of an embedding: it adds its m coordinates ψ, their gradients and their curvatures.
struct EmbeddingView {
  Eigen::Map<Eigen::VectorXd> values;               ///< Coordinates ψ (m).
  Eigen::Map<Eigen::MatrixXd> jacobian_transposed;  ///< ∂ψ/∂q as columns (nv × m).
  Eigen::Map<Eigen::VectorXd> curvatures;           ///< d²ψ/dt² along q̇ = v, q̈ = 0 (m).
  ClearanceView clearances;                         ///< Clearances of barriers; other embeddings leave them as they are.
  /// Activation distances (m) in place of the embedding's own, see Barrier; empty: its own.
  Eigen::Map<const Eigen::VectorXd> activations{nullptr, 0};
  double horizon = 0.0;  ///< Least time τ [s] within which approaching obstacles count, see Horizon.
};

/// Extra coordinates ψ(q, t) that embed the joint space in R^(nv + m) as the graph q ↦ (q, ψ(q, t)).
///
/// Only ψ, ∂ψ/∂q and the m scalars d²ψ/dt² along the motion are needed by the dynamics: the geodesic term follows
/// from them in closed form, without third-order tensors. Where obstacles move, their velocities enter d²ψ/dt².
class Embedding {
 public:
  explicit Embedding(Robot robot) : robot_(std::move(robot)) {}
  virtual ~Embedding() = default;
  Embedding(const Embedding&) = default;
  Embedding& operator=(const Embedding&) = default;

  virtual int num_coordinates() const noexcept = 0;

  /// Adds to `out`, which the caller has zeroed. No allocation.
  virtual void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept = 0;

  /// Label of coordinate k. Allocates: for construction, not for the loop.
  virtual CoordinateLabel label(int k) const;

  /// Lowers `distances` (nv) to the distance [m] between the obstacles and what each joint carries directly
  /// (thesis T6.1). Embeddings without a body leave it as it is. No allocation.
  virtual void lower_distances(Eigen::Ref<Eigen::VectorXd> distances, const KinematicState& state,
                               const Obstacles& obstacles) const noexcept;

  /// Whether balls inside the body's parts reach deeper than `depth` [m] into an obstacle. If they do not, the parts still may.
  /// Much quicker than `add_to`. False without a body. No allocation.
  virtual bool touches(const KinematicState& state, const Obstacles& obstacles, double depth) const noexcept;

  /// Whether `lower_distances` does anything.
  virtual bool measures_distances() const noexcept { return false; }

  /// Writes the embedding's own activation distances (m) [m | rad]; infinity where it is no barrier. No allocation.
  virtual void write_activations(Eigen::Ref<Eigen::VectorXd> activations) const noexcept;

  /// Lowers activation distances (m) so that a configuration with these clearances (m) is left free, see Barrier.
  /// Changes nothing where it is no barrier. No allocation.
  virtual void lower_activations(ConstVectorRef clearances, Eigen::Ref<Eigen::VectorXd> activations) const noexcept;

  /// The robot the embedding was made for.
  const Robot& robot() const noexcept { return robot_; }

 private:
  Robot robot_;
};

/// Values (m), Jacobian (m × nv) and curvatures (m) of an embedding at (q, v).
struct EmbeddingEvaluation {
  Eigen::VectorXd values;
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd curvatures;
  Clearances clearances;
};
EmbeddingEvaluation evaluate(const Embedding& embedding, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                             const Obstacles& obstacles);

/// Hessians ∂²ψ_i/∂q² (m of nv × nv), exact: the curvature at zero obstacle velocity is the quadratic form vᵀ H v,
/// read off by polarisation. For tests and plots; nv(nv+1)/2 evaluations.
std::vector<Eigen::MatrixXd> hessians(const Embedding& embedding, const Eigen::VectorXd& q, const Obstacles& obstacles);

}  // namespace sidestep
