#include "sidestep/clearance/stopping_clearance.hpp"

#include <cmath>

namespace sidestep {

void StoppingClearance::add(const ClearanceSample& sample) noexcept {
  const double ahead = sample.value + horizon_ * sample.rate;
  if (!(ahead < reference_ + BoltzmannMean::window / inverse_T_)) {
    return;
  }
  if (ahead < reference_) {
    const double decay = std::exp((ahead - reference_) * inverse_T_);  // 0 at the first
    weight_ *= decay, sum_.value *= decay, sum_.rate *= decay, sum_.curvature *= decay;
    sum_.gradient.scale(decay);
    reference_ = ahead;
  }
  const double w = std::exp((reference_ - ahead) * inverse_T_);
  weight_ += w;
  sum_.value += w * sample.value;
  sum_.rate += w * sample.rate;
  sum_.curvature += w * sample.curvature;
  sum_.gradient.add(w, sample.gradient);
}

ClearanceSample StoppingClearance::result() const noexcept {
  ClearanceSample mean{sum_.value / weight_, sum_.rate / weight_, sum_.curvature / weight_, sum_.gradient};
  mean.gradient.scale(1.0 / weight_);
  return mean;
}

}  // namespace sidestep
