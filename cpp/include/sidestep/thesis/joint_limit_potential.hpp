#pragma once

#include <Eigen/Core>

#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

/// Smooth steps at the joint limits (Bosc 2024, T5.7, corrected to a sum over the joints):
///
///     ζ(q) = height Σ_j [ s(α (q_j − q_j⁺)) + s(α (q_j⁻ − q_j)) ],   s(u) = 1 / (1 + exp(−u)).
///
/// `slope` α [1/rad | 1/m], `height` in the unit of the coordinate it is added to. At a limit ζ is half the height.
/// Infinite limits add nothing.
class JointLimitPotential final : public Embedding {
 public:
  /// Throws std::invalid_argument unless slope and height are positive and finite.
  explicit JointLimitPotential(const Robot& robot, double slope = 30.0, double height = 1.0);

  int num_coordinates() const noexcept override { return 1; }
  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;

 private:
  Eigen::VectorXd lower_, upper_;
  double slope_, height_;
};

}  // namespace sidestep
