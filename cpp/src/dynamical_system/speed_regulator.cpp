#include "sidestep/dynamical_system/speed_regulator.hpp"

#include <algorithm>
#include <cmath>

#include "../settings.hpp"

namespace sidestep {
namespace {


double power7(double x) noexcept { return x * x * x * x * x * x * x; }

}  // namespace

void SpeedRegulatorSettings::validate() const {
  require(joint_fraction > 0.0, "speed regulator: joint_fraction", joint_fraction, "positive");
  require_positive(rate, "speed regulator: rate");
  require(closing_speed > 0.0, "speed regulator: closing_speed", closing_speed, "positive");
  require(closing_slope >= 0.0 && closing_slope < infinity, "speed regulator: closing_slope", closing_slope,
          "finite and >= 0");
}

SpeedRegulator::SpeedRegulator(SpeedRegulatorSettings settings) : settings_((settings.validate(), settings)) {}

SpeedRegulator::Result SpeedRegulator::operator()(ConstVectorRef v,
                                                  ConstVectorRef a,
                                                  const JointLimits& limits,
                                                  const Clearances& clearances) const noexcept {
  // With f = Σ r^8 and f' = Σ 8 r^7 r': ρ = f^(1/8), ρ'/ρ = f'/(8 f).
  double eighth_powers = 0.0, slopes = 0.0;  // f and f'/8
  const auto add = [&](double ratio, double rate) {
    const double seventh = power7(ratio);
    eighth_powers += seventh * ratio;
    slopes += seventh * rate;
  };
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const double allowed = settings_.joint_fraction * limits.velocity[j];
    add(std::abs(v[j]) / allowed, std::copysign(a[j], a[j] * v[j]) / allowed);
  }
  for (Eigen::Index k = 0; settings_.closing_speed < infinity && k < clearances.nearest.size(); ++k) {
    if (clearances.nearest[k] < 0) {
      continue;
    }
    const auto gradient = clearances.gradients.col(k);
    const double closing = -gradient.dot(v);
    if (closing <= 0.0) {
      continue;
    }
    const double h = clearances.values[k];
    const double allowed = settings_.closing_speed + settings_.closing_slope * std::max(h, 0.0);
    const double closing_rate = -gradient.dot(a) - clearances.curvatures[k];
    const double allowed_rate = h > 0.0 ? settings_.closing_slope * clearances.rates[k] : 0.0;
    add(closing / allowed, (closing_rate - closing / allowed * allowed_rate) / allowed);
  }
  if (!(eighth_powers > 0.0)) {
    return {0.0, 0.0};
  }
  const double ratio = std::pow(eighth_powers, 0.125);
  // dρ/dt + β ρ <= rate (1 − ρ)/min(ρ, 1), divided by ρ.
  const double drag = settings_.rate * (1.0 - ratio) / (ratio * std::min(ratio, 1.0)) - slopes / eighth_powers;
  return {ratio, std::min(drag, 0.0)};
}

}  // namespace sidestep
