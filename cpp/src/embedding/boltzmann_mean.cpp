#include "sidestep/embedding/boltzmann_mean.hpp"

namespace sidestep {

bool BoltzmannMean::add(const ClearanceSample& sample) noexcept {
  const bool smallest = sample.value < reference_;
  if (smallest) {
    if (!empty()) {
      // Measured from the new reference, the old values are larger by `shift` and the old weights smaller.
      const double shift = reference_ - sample.value;
      const double decay = std::exp(-shift * inverse_T_);
      s1_ = decay * (s1_ + shift * s0_);
      s1_dot_ = decay * (s1_dot_ + shift * s0_dot_);
      s1_ddot_ = decay * (s1_ddot_ + shift * s0_ddot_);
      c1_ = decay * (c1_ + shift * c0_);
      c0_ *= decay;
      g1_.add(shift, g0_);
      g1_.scale(decay);
      s0_ *= decay, s0_dot_ *= decay, s0_ddot_ *= decay;
      g0_.scale(decay);
    }
    reference_ = sample.value;
  }
  const double above = sample.value - reference_;
  const double w = std::exp(-above * inverse_T_);
  const double w_dot = -w * sample.rate * inverse_T_;
  const double w_ddot = w * (sample.rate * sample.rate * inverse_T_ - sample.curvature) * inverse_T_;
  s0_ += w;
  s0_dot_ += w_dot;
  s0_ddot_ += w_ddot;
  s1_ += w * above;
  c0_ += w * sample.curvature;
  c1_ += w * above * sample.curvature;
  s1_dot_ += w_dot * above + w * sample.rate;
  s1_ddot_ += w_ddot * above + 2.0 * w_dot * sample.rate + w * sample.curvature;
  g0_.add(-w * inverse_T_, sample.gradient);
  g1_.add(w - w * inverse_T_ * above, sample.gradient);
  return smallest;
}

ClearanceSample BoltzmannMean::result() const noexcept {
  const double above = s1_ / s0_;
  const double rate = (s1_dot_ - above * s0_dot_) / s0_;
  WrenchPair gradient = g1_;
  gradient.add(-above, g0_);
  gradient.scale(1.0 / s0_);
  const double curvature = (s1_ddot_ - 2.0 * rate * s0_dot_ - above * s0_ddot_) / s0_;
  return {reference_ + above, rate, curvature, gradient, curvature - (c0_ - (c1_ - above * c0_) * inverse_T_) / s0_};
}

}  // namespace sidestep
