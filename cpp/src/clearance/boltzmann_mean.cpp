#include "sidestep/clearance/boltzmann_mean.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {

bool BoltzmannMean::add(const ClearanceSample& sample) noexcept {
  const bool smallest = sample.value < reference_;
  if (smallest) {
    if (!empty()) {
      // Measured from the new reference, the old values are larger by `shift` and the old weights smaller.
      const double shift = reference_ - sample.value;
      const double decay = std::exp(-shift * inverse_T_);
      sums_.s1 = decay * (sums_.s1 + shift * sums_.s0);
      sums_.s1_dot = decay * (sums_.s1_dot + shift * sums_.s0_dot);
      sums_.s1_ddot = decay * (sums_.s1_ddot + shift * sums_.s0_ddot);
      g1_.add(shift, g0_);
      g1_.scale(decay);
      sums_.s0 *= decay, sums_.s0_dot *= decay, sums_.s0_ddot *= decay;
      g0_.scale(decay);
    }
    reference_ = sample.value;
  }
  const double above = sample.value - reference_;
  const double w = std::exp(-above * inverse_T_);
  const double w_dot = -w * sample.rate * inverse_T_;
  const double w_ddot = w * (sample.rate * sample.rate * inverse_T_ - sample.curvature) * inverse_T_;
  sums_.s0 += w;
  sums_.s0_dot += w_dot;
  sums_.s0_ddot += w_ddot;
  sums_.s1 += w * above;
  sums_.s1_dot += w_dot * above + w * sample.rate;
  sums_.s1_ddot += w_ddot * above + 2.0 * w_dot * sample.rate + w * sample.curvature;
  g0_.add(-w * inverse_T_, sample.gradient);
  g1_.add(w - w * inverse_T_ * above, sample.gradient);
  return smallest;
}

ClearanceSample BoltzmannMean::result() const noexcept {
  ClearanceSample mean = sums_.mean();
  mean.gradient = g1_;
  mean.gradient.add(-mean.value, g0_);
  mean.gradient.scale(1.0 / sums_.s0);
  mean.value += reference_;
  return mean;
}

double checked_temperature(double temperature, const char* owner) {
  if (!(temperature > 0.0) || !std::isfinite(temperature)) {
    throw std::invalid_argument(std::string(owner) + ": temperature is " + std::to_string(temperature) +
                                " m, must be positive and finite");
  }
  return temperature;
}

}  // namespace sidestep
