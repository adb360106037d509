#pragma once

#include <Eigen/Core>
#include <memory>

#include "sidestep/body/body.hpp"
#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

/// The thesis's embedding (Bosc 2024, T3.1–T3.7): the body's Gaussian mixture, evaluated at the obstacle points,
///
///     ψ(q) = Σ_points x Σ_links l Σ_k π_k N(x | o_l + R_l μ_k, R_l Σ_k R_lᵀ + r² I),   [m⁻³]
///
/// where the radius r of a point widens the Gaussian: the overlap with an isotropic Gaussian of standard deviation r.
/// The point is moved to the link frame, y = R_lᵀ (x − o_l), instead of rotating Σ, so all derivatives are those of y:
///
///     dψ/dt   = ∇_y N · ẏ,      ẏ = R_lᵀ (ẋ − v_l(x)),
///     d²ψ/dt² = ẏᵀ (∇²_y N) ẏ + ∇_y N · ÿ.
///
/// Links that no joint moves are left out: they add a value that the arm cannot change.
/// Gaussians are taken side by side, with the widest registers of the machine. Cost: O(points × Gaussians + joints).
class CollisionDensity final : public Embedding {
 public:
  /// `average` divides by the number of points (as the thesis's code does, its text does not).
  /// Throws std::invalid_argument if a link of the body is unknown or nothing of the body moves.
  CollisionDensity(const Robot& robot, const Body& body, bool average = false);

  /// Multiplications and additions for a Gaussian and a point at rest without radius, comparisons left out: of the
  /// motion of the link's point 15, of the offset 21 and its rate 15 in the link, of its acceleration 24, of the
  /// exponent 21, of the exponential with its factor 35, of gradient and wrench 38, and of the second derivative 31.
  static constexpr int operations_per_pair = 15 + 21 + 15 + 24 + 21 + 35 + 38 + 31;

  int num_coordinates() const noexcept override { return 1; }
  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;

  /// Distances between Gaussian means and the surfaces of the obstacle points.
  void lower_distances(Eigen::Ref<Eigen::VectorXd> distances, const KinematicState& state,
                       const Obstacles& obstacles) const noexcept override;
  bool measures_distances() const noexcept override { return true; }

 private:
  struct Gaussians;  // Gaussians of the links that a joint moves, those of the last joint first.

  bool average_;
  std::shared_ptr<const Gaussians> gaussians_;
};

}  // namespace sidestep
