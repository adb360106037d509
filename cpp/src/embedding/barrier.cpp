#include "sidestep/embedding/barrier.hpp"

#include <algorithm>
#include <utility>

namespace sidestep {

Barrier::Barrier(Robot robot, const BarrierFunction& function, const char* owner)
    : Embedding(std::move(robot)), function_(function) {
  function_.validate(owner);
}

void Barrier::add_barriers(EmbeddingView out) const noexcept {
  if (!is_seen()) {
    out.clearances.margins = margin_share * activations_;
  }
  BarrierFunction function = function_;
  for (Eigen::Index k = 0; k < out.values.size(); ++k) {
    const double h = out.clearances.values[k];
    if (!(h < activations_[k])) {
      continue;
    }
    // ψ = f(h): ∇ψ = f' ∇h,  ψ̈ = f' ḧ + f'' ḣ².
    function.activation = activations_[k];
    const BarrierFunction::Value f = function(h);
    const double rate = out.clearances.rates[k];
    out.values[k] += f.value;
    out.jacobian_transposed.col(k) += f.first * out.clearances.gradients.col(k);
    out.curvatures[k] += f.first * out.clearances.curvatures[k] + f.second * rate * rate;
  }
}

std::shared_ptr<const Embedding> Barrier::relaxed_at(const Eigen::VectorXd& goal, const Obstacles& obstacles) const {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(goal.size());
  const Eigen::VectorXd clearances = evaluate(*this, goal, rest, obstacles).clearances.values;
  std::shared_ptr<Barrier> relaxed = clone();
  const double least = std::min(relaxed_floors * function_.floor, function_.activation);
  for (Eigen::Index k = 0; k < clearances.size(); ++k) {
    relaxed->activations_[k] = std::clamp(relaxed_share * clearances[k], least, std::max(least, activations_[k]));
  }
  return relaxed;
}

}  // namespace sidestep
