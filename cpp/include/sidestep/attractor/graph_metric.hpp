#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "sidestep/math/vectors.hpp"

namespace sidestep {

/// The metric of the graph q ↦ (q, ψ(q)), from J = ∂ψ/∂q (m × nv):
///
///     G = I + Jᵀ J                                              (T2.9, T4.1 for m = 1)
///
/// Coordinates whose gradient is zero, such as barriers out of reach, cost nothing: only the others are used.
///
/// Next to an obstacle J is large, and G alone loses the digits of all other directions: |J|² is 1e12 beside a thin
/// Gaussian. While at most nv coordinates are in use the small matrix S = I + J Jᵀ is factorised instead (Woodbury;
/// Sherman–Morrison for one):
///
///     G⁻¹ x = x − Jᵀ S⁻¹ J x,     G⁻¹ Jᵀ c = Jᵀ S⁻¹ c.
///
/// Beyond that G itself is, by Cholesky, with errors of |J|² times rounding.
class GraphMetric {
 public:
  /// For `nv` joint coordinates and `m` embedding coordinates; starts flat, G = I.
  GraphMetric(int nv, int m);

  /// Takes J as its transpose (nv × m). No allocation.
  void update(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed) noexcept;

  /// x ← G⁻¹ x. No allocation.
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> x) noexcept;

  /// x ← G⁻¹ Jᵀ c for c (m). No allocation.
  void solve_pullback(ConstVectorRef c, Eigen::Ref<Eigen::VectorXd> x) noexcept;

  /// G itself (nv × nv), for tests and plots.
  Eigen::MatrixXd matrix() const;

 private:
  auto columns() const noexcept { return jacobian_transposed_.leftCols(num_used_); }
  bool is_small() const noexcept { return num_used_ <= jacobian_transposed_.rows(); }
  void solve_factored(Eigen::Ref<Eigen::VectorXd> x) const noexcept;

  Eigen::Index num_used_ = 0;            // Number of coordinates with a gradient.
  std::vector<Eigen::Index> used_;       // Indices of these.
  Eigen::MatrixXd jacobian_transposed_;  // Their gradients, as columns, with padding behind them.
  Eigen::MatrixXd factor_;               // S if it is a number; else the Cholesky factor of S, or of G, top left
  Eigen::VectorXd along_;                // J x, then S⁻¹ J x
};

/// The geodesic acceleration g = −Ξ v = −G⁻¹ Jᵀ c (T5.3 in closed form), from J (m × nv) and c = d²ψ/dt² (m).
/// For tests and plots; the system computes the same without allocation.
Eigen::VectorXd geodesic_acceleration(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& curvatures);

/// Christoffel symbols of the second kind, Γ[k](i, j) = Γᵏ_ij, from the derivatives of the metric (T4.11),
///
///     Γᵏ_ij = ½ G^kl (∂_i G_lj + ∂_j G_li − ∂_l G_ij),   ∂_k G_ij = Σ_a (H_a,ki J_aj + J_ai H_a,kj),
///
/// with every tensor dense. The slow second implementation: −Γᵏ_ij vⁱ vʲ must equal `geodesic_acceleration`.
std::vector<Eigen::MatrixXd> christoffel_symbols(const Eigen::MatrixXd& jacobian, const std::vector<Eigen::MatrixXd>& hessians);

}  // namespace sidestep
