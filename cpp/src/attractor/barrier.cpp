#include "sidestep/attractor/barrier.hpp"

#include <algorithm>
#include <utility>

namespace sidestep {

Barrier::Barrier(Robot robot, const BarrierFunction& function, const char* owner)
    : Embedding(std::move(robot)), function_(function) {
  function_.validate(owner);
}

void Barrier::add_barriers(EmbeddingView out) const noexcept {
  const Eigen::Map<const Eigen::VectorXd> own(activations_.data(), activations_.size());
  const Eigen::Map<const Eigen::VectorXd> activations = out.activations.size() == own.size() ? out.activations : own;
  if (!is_seen()) {
    out.clearances.margins = margin_share * activations;
  }
  BarrierFunction function = function_;
  for (Eigen::Index k = 0; k < out.values.size(); ++k) {
    const double h = out.clearances.values[k];
    if (!(h < activations[k])) {
      continue;
    }
    // ψ = f(h): ∇ψ = f' ∇h,  ψ̈ = f' ḧ + f'' ḣ².
    function.activation = activations[k];
    function.floor = floor(k);
    const BarrierFunction::Value f = function(h);
    const double rate = out.clearances.rates[k];
    out.values[k] += f.value;
    out.jacobian_transposed.col(k) += f.first * out.clearances.gradients.col(k);
    out.curvatures[k] += f.first * out.clearances.curvatures[k] + f.second * rate * rate;
  }
}

void Barrier::lower_activations(ConstVectorRef clearances, Eigen::Ref<Eigen::VectorXd> activations) const noexcept {
  for (Eigen::Index k = 0; k < activations.size(); ++k) {
    const double least = std::min(relaxed_floors * floor(k), activations_[k]);
    activations[k] = std::clamp(relaxed_share * clearances[k], least, std::max(least, activations[k]));
  }
}

}  // namespace sidestep
