#pragma once

#include <algorithm>
#include <cmath>

#include "sidestep/constraints/acceleration_bounds.hpp"

namespace sidestep {

// Shares of the jerk limits that one row uses [-]: usually, so that two can rise together, and at most.
inline constexpr double of_jerk = 0.5, of_jerk_alone = 0.95;

/// κ, see clearance_demand.hpp: how many times harder than −v/τ an arm must stop to keep a distance left > 0.
inline double hardness_of_stop(double distance_left, double u, double c, double stop_time) noexcept {
  const double linear = 0.5 * u * stop_time, bent = 0.125 * std::max(-c, 0.0) * stop_time * stop_time;
  return (linear + std::sqrt(linear * linear + 4.0 * bent * distance_left)) / (2.0 * distance_left);
}

/// Whether a stop that begins at a closing speed u, slowing by `slowing` now, fits into the distance left: by at most A, with jerk J.
inline bool smooth_stop_fits(double distance_left, double u, double slowing, double A, double J, double period) noexcept {
  const double next = u - slowing * period;
  return distance_left - std::max(u, next) * period >= jerk_braking_distance(next, std::max(-slowing, -A), A, J);
}

/// The least x in [low, high], but for rounding, that fits; `high` does.
template <class Fits>
double least_that_fits(double low, double high, const Fits& fits) noexcept {
  if (low >= high || fits(low)) {
    return low;
  }
  constexpr int halvings = 12;  // Halvings of the interval.
  for (int n = 0; n < halvings; ++n) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace sidestep
