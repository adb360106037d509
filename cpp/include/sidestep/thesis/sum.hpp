#pragma once

#include <memory>
#include <vector>

#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

/// Several embeddings added into the same coordinates, ψ = Σ_i ψ_i (the thesis's way, T5.8: density plus limits).
/// Listing embeddings in a GeometricSystem gives each its own coordinates instead.
class Sum final : public Embedding {
 public:
  /// Throws std::invalid_argument if there is no term, or the terms differ in coordinates or robot.
  explicit Sum(std::vector<std::shared_ptr<const Embedding>> terms);

  int num_coordinates() const noexcept override { return terms_.front()->num_coordinates(); }
  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;
  void lower_distances(Eigen::Ref<Eigen::VectorXd> distances, const KinematicState& state,
                       const Obstacles& obstacles) const noexcept override;
  bool measures_distances() const noexcept override;

 private:
  std::vector<std::shared_ptr<const Embedding>> terms_;
};

}  // namespace sidestep
