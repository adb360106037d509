#include "sidestep/constraints/acceleration_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

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

/// The largest next velocity that keeps the way `distance_left` = (limit - q) to an upper position limit.
double largest_next_velocity(double distance_left, double v, double acceleration, double period) noexcept {
  if (distance_left == infinity) {
    return infinity;
  }
  const bool braking = v * period + braking_distance(v, acceleration, period) > distance_left;
  const double c = braking ? 0.5 : 1.0;
  const double rest = distance_left - (1.0 - c) * v * period;  // what is left for D(w) + c w T
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

double viable_velocity(double q, double v, const ScalarLimits& limits, double period) noexcept {
  const auto fastest = [&](double distance_left) {
    return distance_left == infinity
               ? limits.velocity
               : std::min(limits.velocity, speed_within(std::max(distance_left, 0.0), 0.0, limits.acceleration, period));
  };
  return std::clamp(v, -fastest(q - limits.lower), fastest(limits.upper - q));
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

namespace {

/// Lets the acceleration limit give way up to a factor; position and velocity limits stay.
void widen(AccelerationInterval& interval, double q, double v, const ScalarLimits& limits, double factor,
           double period) noexcept {
  ScalarLimits wide = limits;
  wide.acceleration *= factor;
  const double A = limits.acceleration;
  const auto by_limit = [&](double distance_left, double speed) {
    return (std::min(largest_next_velocity(distance_left, speed, A, period), limits.velocity) - speed) / period;
  };
  if (interval.upper_limit == Limit::acceleration_upper && interval.upper >= A) {
    interval.upper = std::max(interval.upper, std::min(wide.acceleration, by_limit(limits.upper - q, v)));
  }
  if (interval.lower_limit == Limit::acceleration_lower && interval.lower <= -A) {
    interval.lower = std::min(interval.lower, -std::min(wide.acceleration, by_limit(q - limits.lower, -v)));
  }
  // Where a limit asks for more than A, it may have it.
  if (interval.upper <= -A && interval.position_upper < interval.upper) {
    interval.upper = std::max(interval.position_upper, -wide.acceleration);
    interval.lower = std::min(interval.lower, interval.upper);
  }
  if (interval.lower >= A && interval.position_lower > interval.lower) {
    interval.lower = std::min(interval.position_lower, wide.acceleration);
    interval.upper = std::max(interval.lower, interval.upper);
  }
  interval.position_lower = std::min(interval.position_lower, interval.lower);
  interval.position_upper = std::max(interval.position_upper, interval.upper);
}

/// From outside of a position limit, and not on the way farther out, the way back can wait for the jerk: by `step` a period.
void return_smoothly(AccelerationInterval& interval, double q, double v, double before, const ScalarLimits& limits, double step,
                     double period) noexcept {
  if (q < limits.lower && v >= 0.0) {
    interval.lower = std::min(interval.lower, std::max({before + step, -v / period, -limits.acceleration}));
    interval.position_lower = std::min(interval.position_lower, interval.lower);
  }
  if (q > limits.upper && v <= 0.0) {
    interval.upper = std::max(interval.upper, std::min({before - step, -v / period, limits.acceleration}));
    interval.position_upper = std::max(interval.position_upper, interval.upper);
  }
}

}  // namespace

double jerk_braking_distance(double v, double a, double A, double J) noexcept {
  // From rest of the acceleration: a ramp, a hold and a ramp, symmetric, so that the mean speed is half of the first.
  const auto from_rest = [A, J](double speed) {
    if (!(speed > 0.0)) {
      return 0.0;
    }
    const double ramp = A / J;
    return speed >= A * ramp ? 0.5 * speed * (speed / A + ramp) : speed * std::sqrt(speed / J);
  };
  const double time = std::abs(a) / J;  // until, or since, no acceleration
  if (a > 0.0) {
    const double way = time * (v + a * time / 3.0);
    return std::max(0.0, way + from_rest(v + 0.5 * a * time));
  }
  if (v <= 0.0) {
    return 0.0;
  }
  if (v < -0.5 * a * time) {  // braking harder than that: it turns back before the acceleration is gone
    const double until = (-a - std::sqrt(std::max(a * a - 2.0 * J * v, 0.0))) / J;
    return until * (v + until * (0.5 * a + J * until / 6.0));
  }
  // As if it had begun to brake `time` ago.
  const double first = v - 0.5 * a * time;
  return from_rest(first) - time * (first + a * time / 6.0);
}

ReturnableAcceleration largest_returnable(double distance_left, double speed, double least, double largest,
                                          const ScalarLimits& limits, double jerk, double period) noexcept {
  ReturnableAcceleration found{largest};
  const double step = jerk * period, A = limits.acceleration, half = 0.5 * step;
  // v + xT <= V, or with y = x - JT/2 > 0:  v + JT²/2 + yT + y²/2J <= V
  const double left = limits.velocity - speed;
  double by_velocity = left / period;
  if (by_velocity > half) {
    by_velocity = half + jerk * (std::sqrt(std::max(period * period + 2.0 * (left - half * period) / jerk, 0.0)) - period);
  }
  if (by_velocity < found.value) {
    found.value = by_velocity;
    found.by_velocity = true;
  }
  const auto fits = [&](double candidate) {
    const double next = speed + candidate * period, then = std::max(candidate - half, -A);
    const double fastest = then > 0.0 ? next + 0.5 * then * then / jerk : next;  // of the profile
    return (std::max(next, 0.5 * (next + speed)) + 0.5 * std::max(fastest, 0.0)) * period +
               jerk_braking_distance(next, then, A, jerk) <=
           distance_left;
  };
  if (distance_left < infinity && !fits(found.value)) {
    found.by_position = true;
    double low = least, high = found.value;
    constexpr int halvings = 24;  // Halvings of the interval of accelerations.
    for (int k = 0; k < halvings && high > low; ++k) {
      const double middle = 0.5 * (low + high);
      (fits(middle) ? low : high) = middle;
    }
    found.value = low;
  }
  return found;
}

SmoothInterval smooth_interval(double q, double v, double before, const AccelerationInterval& interval,
                               const ScalarLimits& limits, double jerk, double period) noexcept {
  const double step = jerk * period;
  SmoothInterval smooth{interval.lower, interval.upper, interval.lower_limit, interval.upper_limit};
  if (!(step < infinity)) {
    return smooth;
  }
  // Of a state that may be mirrored, towards an upper limit.
  const auto viable_up_to = [&](double distance_left, double speed, double least, double largest, Limit at_velocity,
                                Limit at_position, Limit& limit) {
    const ReturnableAcceleration found = largest_returnable(distance_left, speed, least, largest, limits, jerk, period);
    limit = found.by_position ? at_position : found.by_velocity ? at_velocity : limit;
    return found.value;
  };
  Limit upper_limit = Limit::jerk_upper, lower_limit = Limit::jerk_lower;
  const double upper = viable_up_to(limits.upper - q, v, before - step, before + step, Limit::velocity_upper,
                                    Limit::position_upper, upper_limit);
  const double lower = -viable_up_to(q - limits.lower, -v, -before - step, -before + step, Limit::velocity_lower,
                                     Limit::position_lower, lower_limit);
  if (upper < smooth.upper) {
    smooth.upper = std::max(upper, before - step);
    smooth.upper_limit = upper_limit;
  }
  if (lower > smooth.lower) {
    smooth.lower = std::min(lower, before + step);
    smooth.lower_limit = lower_limit;
  }
  smooth.upper = std::clamp(smooth.upper, interval.lower, interval.upper);
  smooth.lower = std::clamp(smooth.lower, interval.lower, interval.upper);
  if (smooth.lower > smooth.upper) {  // both ways at once, of a state that was not reached this way
    smooth.lower = smooth.upper = std::clamp(std::clamp(0.0, smooth.upper, smooth.lower), before - step, before + step);
    smooth.lower = smooth.upper = std::clamp(smooth.lower, interval.lower, interval.upper);
  }
  return smooth;
}

AccelerationBounds::AccelerationBounds(int num_coordinates)
    : lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      lower_limit(static_cast<std::size_t>(num_coordinates), Limit::none),
      upper_limit(static_cast<std::size_t>(num_coordinates), Limit::none),
      smooth_lower(lower),
      smooth_upper(upper),
      smooth_lower_limit(lower_limit),
      smooth_upper_limit(upper_limit),
      position_lower(lower),
      position_upper(upper) {}

void AccelerationBounds::update(const JointLimits& limits, ConstVectorRef q, ConstVectorRef v, double period,
                                const LimitMargins& margins, const Eigen::VectorXd* before) noexcept {
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    const ScalarLimits joint{limits.lower[i] + margins.position, limits.upper[i] - margins.position, limits.velocity[i],
                             limits.acceleration[i]};
    AccelerationInterval interval = acceleration_interval(q[i], v[i], joint, period);
    if (margins.acceleration_factor > 1.0) {
      widen(interval, q[i], v[i], joint, margins.acceleration_factor, period);
    }
    const double jerk = before == nullptr ? infinity : margins.jerk_share * limits.jerk[i];
    if (before != nullptr) {
      return_smoothly(interval, q[i], v[i], (*before)[i], joint, jerk * period, period);
    }
    const auto at = static_cast<std::size_t>(i);
    lower[i] = interval.lower;
    upper[i] = interval.upper;
    position_lower[i] = interval.position_lower;
    position_upper[i] = interval.position_upper;
    lower_limit[at] = interval.lower_limit;
    upper_limit[at] = interval.upper_limit;
    const SmoothInterval smooth =
        smooth_interval(q[i], v[i], before == nullptr ? 0.0 : (*before)[i], interval, joint, jerk, period);
    smooth_lower[i] = smooth.lower;
    smooth_upper[i] = smooth.upper;
    smooth_lower_limit[at] = smooth.lower_limit;
    smooth_upper_limit[at] = smooth.upper_limit;
  }
}

void AccelerationBounds::draw_in(const Eigen::VectorXd& limit, ConstVectorRef wanted) noexcept {
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    const double high = std::max(limit[i], wanted[i]), low = std::min(-limit[i], wanted[i]);
    upper[i] = std::max(std::min(upper[i], high), lower[i]);
    lower[i] = std::min(std::max(lower[i], low), upper[i]);
    smooth_upper[i] = std::clamp(smooth_upper[i], lower[i], upper[i]);
    smooth_lower[i] = std::clamp(smooth_lower[i], lower[i], upper[i]);
  }
}

}  // namespace sidestep
