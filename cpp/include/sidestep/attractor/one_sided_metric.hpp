#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/attractor/graph_metric.hpp"

namespace sidestep {

/// The metric of the graph as a resistance that acts one way: against motion by which ψ rises, not by which it falls.
///
/// G⁻¹ x = argmin ½ |a − x|² + ½ Σ_k (J_k·a)² weakens all of x that changes any ψ_k, also what leads away from an
/// obstacle, and with as many barriers in use as joints nothing of x is left. One-sided, what x becomes is
///
///     argmin_a  ½ |a − x|² + ½ Σ_k max(0, J_k·a)²,
///
/// the solution of a strictly convex problem, hence continuous in x and J. With S = {k : J_k·a > 0} it is G_S⁻¹ x for
/// G_S = I + Σ_S J_kᵀ J_k. It vanishes next to a rigid obstacle only where −x is in the cone of the J_k: at a local
/// minimum of the potential on the free set, if x is its negative gradient.
class OneSidedMetric {
 public:
  OneSidedMetric(int nv, int m);

  /// x ← argmin as above, J as its transpose (nv × m). No allocation.
  void solve_in_place(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed, Eigen::Ref<Eigen::VectorXd> x) noexcept;

 private:
  GraphMetric metric_;
  Eigen::MatrixXd columns_, resisting_;  // Gradients in use; those of S, zero elsewhere.
  std::vector<char> in_set_;
  Eigen::VectorXd start_;
};

}  // namespace sidestep
