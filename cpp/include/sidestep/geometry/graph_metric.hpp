#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace sidestep {

/// The metric of the graph q ↦ (q, ψ(q)), from J = ∂ψ/∂q (m × nv):
///
///     G = I + Jᵀ J                                              (T2.9, T4.1 for m = 1)
///
/// For one coordinate G⁻¹ follows from Sherman–Morrison; otherwise G is factorised by Cholesky.
class GraphMetric {
 public:
  /// For `nv` joint coordinates; starts flat, G = I.
  explicit GraphMetric(int nv);

  /// Takes J as its transpose (nv × m). No allocation.
  void update(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed) noexcept;

  /// x ← G⁻¹ x. No allocation.
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> x) const noexcept;

  const Eigen::MatrixXd& matrix() const noexcept { return matrix_; }

 private:
  Eigen::MatrixXd matrix_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd gradient_;      // of the single coordinate, where there is one
  double inverse_scale_ = 1.0;    // 1 / (1 + |gradient|²)
  bool rank_one_ = true;
};

/// The geodesic acceleration g = −Ξ v = −G⁻¹ Jᵀ c (T5.3 in closed form), from J (m × nv) and c = d²ψ/dt² (m).
/// For tests and plots; the system computes the same without allocation.
Eigen::VectorXd geodesic_acceleration(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& curvatures);

/// Christoffel symbols of the second kind, Γ[k](i, j) = Γᵏ_ij, from the derivatives of the metric (T4.11),
///
///     Γᵏ_ij = ½ G^kl (∂_i G_lj + ∂_j G_li − ∂_l G_ij),   ∂_k G_ij = Σ_a (H_a,ki J_aj + J_ai H_a,kj),
///
/// with every tensor dense. The slow second implementation: −Γᵏ_ij vⁱ vʲ must equal `geodesic_acceleration`.
std::vector<Eigen::MatrixXd> christoffel_symbols(const Eigen::MatrixXd& jacobian,
                                                 const std::vector<Eigen::MatrixXd>& hessians);

}  // namespace sidestep
