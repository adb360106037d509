#include "sidestep/constraints/clearance_demand.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

// Rate at which a missing leaving speed is made up, in units of γ: see the header.
constexpr double firmness = 3.0;

/// The speed w with p(w) + delay w = distance left; with delay = 0 the inverse of p. Odd in the distance.
double profile_speed(double distance_left, double delay, double A, double rate) noexcept {
  const double size = std::abs(distance_left);
  double speed = size / (1.0 / rate + delay);
  if (speed > A / rate) {
    speed = A * (std::sqrt(delay * delay + 2.0 * (size - 0.5 * A / (rate * rate)) / A) - delay);
  }
  return std::copysign(speed, distance_left);
}

/// p(u): the distance that a closing speed needs.
double distance_needed(double speed, double A, double rate) noexcept {
  const double size = std::abs(speed);
  return std::copysign(size > A / rate ? 0.5 * (size * size / A + A / (rate * rate)) : size / rate, speed);
}

}  // namespace

double demanded_deceleration(double distance_left, double u, const ClosingLimits& limits, double period) noexcept {
  const double A = limits.comfortable, rate = limits.rate;
  const bool braking = distance_needed(u, A, rate) + u * period > distance_left;
  const double c = braking ? 0.5 : 1.0;
  const double next = profile_speed(distance_left - (1.0 - c) * u * period, c * period, A, rate);
  const double at_once = (u - next) / period;
  const double allowed = profile_speed(distance_left, 0.0, A, rate);
  if (u <= allowed) {
    return at_once;
  }
  const double along_profile = std::clamp(rate * allowed, -A, A);
  const double left = distance_left - u * period;
  const double for_a_stop = u > 0.0 && left > 0.0 ? std::max(rate * u, u * u / (2.0 * left)) : infinity;
  const double too_fast = std::max(u - std::max(allowed, 0.0), 0.0);  // closing
  const double too_slow = std::max(std::min(u, 0.0) - allowed, 0.0);  // leaving
  const double away = std::min(along_profile + firmness * rate * too_slow, A);
  const double returning = away + limits.correction * too_fast / period;
  return std::min({at_once, returning, for_a_stop, limits.hardest});
}

}  // namespace sidestep
