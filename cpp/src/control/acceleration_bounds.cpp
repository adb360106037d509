#include "sidestep/control/acceleration_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "../settings.hpp"

namespace sidestep {
namespace {


/// The speed w >= 0 with D(w) + c w T = distance >= 0. On the segment n of D the left side grows from
/// (n^2/2 + c n) A T^2 with slope ((2n + 1)/2 + c) T.
double speed_within(double distance, double c, double acceleration, double period) noexcept {
  const double unit = acceleration * period * period;
  const double n = std::isfinite(unit) ? std::floor(std::sqrt(c * c + 2.0 * distance / unit) - c) : 0.0;
  const double start = n > 0.0 ? (0.5 * n * n + c * n) * unit : 0.0;
  const double start_speed = n > 0.0 ? n * acceleration * period : 0.0;
  return std::max(start_speed + (distance - start) / ((n + 0.5 + c) * period), 0.0);
}

/// The largest next velocity that keeps the way `room` = (limit - q) to an upper position limit.
double largest_next_velocity(double room, double v, double acceleration, double period) noexcept {
  if (room == infinity) {
    return infinity;
  }
  const bool braking = v * period + braking_distance(v, acceleration, period) > room;
  const double c = braking ? 0.5 : 1.0;
  const double rest = room - (1.0 - c) * v * period;  // what is left for D(w) + c w T
  if (rest >= 0.0) {
    return speed_within(rest, c, acceleration, period);
  }
  return std::max(rest / (c * period), -speed_within(-rest, 0.0, acceleration, period));
}

}  // namespace

double braking_distance(double speed, double acceleration, double period) noexcept {
  if (!(speed > 0.0)) {
    return 0.0;
  }
  const double unit = acceleration * period;
  const double n = std::isfinite(unit) ? std::floor(speed / unit) : 0.0;
  const double whole = n > 0.0 ? n * unit : 0.0;
  return 0.5 * period * (n * whole + (speed - whole) * (2.0 * n + 1.0));
}

bool is_viable(double q, double v, const ScalarLimits& limits, double period, double tolerance) noexcept {
  return std::abs(v) <= limits.velocity + tolerance &&
         q + braking_distance(v, limits.acceleration, period) <= limits.upper + tolerance &&
         q - braking_distance(-v, limits.acceleration, period) >= limits.lower - tolerance;
}

AccelerationInterval acceleration_interval(double q, double v, const ScalarLimits& limits, double period) noexcept {
  const double V = limits.velocity, A = limits.acceleration;
  double high = largest_next_velocity(limits.upper - q, v, A, period);
  double low = -largest_next_velocity(q - limits.lower, -v, A, period);
  const double position_lower = (low - v) / period, position_upper = (high - v) / period;
  const Limit high_limit = high < V ? Limit::position_upper : Limit::velocity_upper;
  const Limit low_limit = low > -V ? Limit::position_lower : Limit::velocity_lower;
  high = std::clamp(high, -V, V);
  low = std::clamp(low, -V, V);
  if (low > high) {
    // Only from states that are not viable: both position limits cannot be kept. Come as close to rest as they allow.
    low = high = std::clamp(0.0, high, low);
  }
  AccelerationInterval interval{(low - v) / period, (high - v) / period, low_limit, high_limit, 0.0, 0.0};
  if (interval.upper >= A) {
    interval.upper_limit = Limit::acceleration_upper;
  }
  if (interval.lower <= -A) {
    interval.lower_limit = Limit::acceleration_lower;
  }
  interval.lower = std::clamp(interval.lower, -A, A);
  interval.upper = std::clamp(interval.upper, -A, A);
  interval.position_lower = std::min(position_lower, interval.lower);
  interval.position_upper = std::max(position_upper, interval.upper);
  return interval;
}

AccelerationBounds::AccelerationBounds(int num_coordinates)
    : lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      lower_limit(static_cast<std::size_t>(num_coordinates), Limit::none),
      upper_limit(static_cast<std::size_t>(num_coordinates), Limit::none),
      position_lower(lower),
      position_upper(upper) {}

void AccelerationBounds::update(const JointLimits& limits, ConstVectorRef q,
                                ConstVectorRef v, double period,
                                double position_margin) noexcept {
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    const ScalarLimits joint{limits.lower[i] + position_margin, limits.upper[i] - position_margin, limits.velocity[i],
                             limits.acceleration[i]};
    const AccelerationInterval interval = acceleration_interval(q[i], v[i], joint, period);
    lower[i] = interval.lower;
    upper[i] = interval.upper;
    position_lower[i] = interval.position_lower;
    position_upper[i] = interval.position_upper;
    lower_limit[static_cast<std::size_t>(i)] = interval.lower_limit;
    upper_limit[static_cast<std::size_t>(i)] = interval.upper_limit;
  }
}

}  // namespace sidestep
