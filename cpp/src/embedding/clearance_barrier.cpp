#include "sidestep/embedding/clearance_barrier.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

const BarrierFunction& validated(const BarrierFunction& barrier, const char* owner) {
  barrier.validate(owner);
  return barrier;
}

}  // namespace

ClearanceBarrier::ClearanceBarrier(const Robot& robot, const Body& body, BarrierFunction barrier, double temperature,
                                   double reach)
    : Embedding(robot),
      field_(robot, body, temperature),
      barrier_(validated(barrier, "clearance barrier")),
      reach_(std::max(reach, barrier.activation)),
      links_(body.links) {
  if (!std::isfinite(reach)) {
    throw std::invalid_argument("clearance barrier: reach is " + std::to_string(reach) + " m, must be finite");
  }
}

void ClearanceBarrier::add_to(EmbeddingView out, const KinematicState& state,
                              const Obstacles& obstacles) const noexcept {
  field_.evaluate(state, obstacles, reach_, out.clearances);
  add_barriers(barrier_, out);
}

CoordinateLabel ClearanceBarrier::label(int k) const {
  return {CoordinateLabel::Kind::obstacle, links_[static_cast<std::size_t>(field_.component(k))], {}, barrier_.floor};
}

void add_barriers(const BarrierFunction& barrier, EmbeddingView out) noexcept {
  for (Eigen::Index k = 0; k < out.values.size(); ++k) {
    if (out.clearances.nearest[k] < 0) {
      continue;
    }
    // ψ = f(h): ∇ψ = f' ∇h,  ψ̈ = f' ḧ + f'' ḣ².
    const BarrierFunction::Value f = barrier(out.clearances.values[k]);  // zero beyond the activation distance
    const double rate = out.clearances.rates[k];
    out.values[k] += f.value;
    out.jacobian_transposed.col(k) += f.first * out.clearances.gradients.col(k);
    out.curvatures[k] += f.first * out.clearances.curvatures[k] + f.second * rate * rate;
  }
}

}  // namespace sidestep
