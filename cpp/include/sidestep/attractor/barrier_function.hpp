#pragma once

#include <cmath>

namespace sidestep {

/// A barrier over a clearance h, zero from the activation distance on and growing without bound as h → 0:
///
///     ψ(h) = strength (activation / h − 1)^power for h < activation, else 0.
///
/// Below `floor` ψ goes on along its tangent, so that it stays finite where h ≤ 0; the floor is where an arm counts as
/// inside the barrier. power = 2 makes the geodesic acceleration continuous at the activation distance, power = 3 also
/// its derivative; power = 1 would let it jump.
struct BarrierFunction {
  double activation;  ///< Clearance where the barrier begins: larger reacts earlier and gentler, and closes narrow passages.
  double strength;    ///< Strength: larger turns the motion away earlier within the activation distance.
  double power;       ///< Exponent: larger stays flat longer and rises steeper.
  double floor;       ///< Smallest clearance at which the formula is used.

  struct Value {
    double value, first, second;  ///< The barrier ψ, dψ/dh, d²ψ/dh².
  };

  Value operator()(double h) const noexcept {
    if (h >= activation) {
      return {0.0, 0.0, 0.0};
    }
    const double at = h < floor ? floor : h;
    const double base = activation / at - 1.0;
    const double slope = -activation / (at * at);  // d base / dh
    const double bend = 2.0 * activation / (at * at * at);
    const double p2 = std::pow(base, power - 2.0);
    const double p1 = p2 * base;
    const double first = strength * power * p1 * slope;
    if (h < floor) {
      return {strength * p1 * base + first * (h - floor), first, 0.0};
    }
    return {strength * p1 * base, first, strength * power * ((power - 1.0) * p2 * slope * slope + p1 * bend)};
  }

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate(const char* owner) const;
};

}  // namespace sidestep
