// What one clearance that closes asks for, see clearance_demand.hpp.
#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"
#include "largest_product.hpp"
#include "sidestep/constraints/clearance_constraints.hpp"
#include "smooth_stop.hpp"
#include "tolerances.hpp"

namespace sidestep {
namespace {

// Closing speed beyond the arm's own that the margin holds off [m/s].
constexpr double slow = 0.01;
// Braking deceleration that stands for zero [m/s²], so that the profile stays defined.
constexpr double least_deceleration = 1e-6;
// Share of the deceleration by acceleration or torque limits alone [-]: only where so little would not suffice, what both
// allow together is computed.
constexpr double scarce = 0.05;
// Share of the hardest deceleration that a smooth stop counts on [-].
constexpr double of_hardest = 0.75;

}  // namespace

ClearanceConstraints::Closing ClearanceConstraints::closing_of(int row, const Clearances& clearances, const BrakingState& state,
                                                               const PathStop& stop, double& required) noexcept {
  const JointLimits& limits = state.limits;
  const ClearanceState& approach = clearances.approach;
  const int k = coordinates_[static_cast<std::size_t>(row)];
  const auto gradient = approach.gradients.col(k);
  const double by_torque = state.torque == nullptr ? infinity : braking_.hardest_by_torque(row, limits, *state.torque);
  const double by_limits = largest_product(gradient, -limits.acceleration, limits.acceleration);
  const double distance_left = distance_left_of(clearances, k), u = -approach.rates[k];
  // Either limit alone may promise more than both allow together: torques that brake hardest may fling joints about.
  double by_both = std::min(by_limits, by_torque);
  const bool counts = state.torque != nullptr && u > 0.0 && u / stop.rate + 0.5 * u * u / (scarce * by_both) > distance_left;
  if (counts) {
    by_both = std::min(by_both, braking_.largest_by_both(gradient, least_, limits.acceleration, by_both));
  }
  const double hardest = std::max(std::min(by_limits, by_torque), least_deceleration);
  const ClosingLimits closing{std::max(settings_.braking_fraction * by_both, least_deceleration), hardest, stop.rate,
                              settings_.correction};
  // Curvature of the point, limited by that of the mean if a surface recedes: see the header.
  const double c = std::min(approach.curvatures[k], std::max(clearances.curvatures[k], 0.0));
  required = demanded_deceleration(distance_left, u, closing, state.period) - c;
  double now = std::min(largest_product(gradient, state.bounds.lower, state.bounds.upper), by_torque);
  if (counts && required > 0.0) {
    now = std::min(now, braking_.largest_by_both(gradient, state.bounds.lower, state.bounds.upper, now));
  }
  const double net = now + std::min(c, 0.0);  // a curvature that helps fades as the arm slows
  const bool lasts = net > 0.0 && (u <= 0.0 || distance_left >= u * u / (2.0 * net));
  return {distance_left, u, c, -gradient.dot(state.v), hardest, now, lasts, net, closing};
}

double ClearanceConstraints::without_excess(double required, const Closing& closing, int row, double period,
                                            PathStop& stop) const noexcept {
  const auto& [distance_left, u, c, of_arm, hardest, now, lasts, net, limits] = closing;
  if (distance_left > 0.0 && stop.tau > 0.0 && u <= of_arm + slow) {
    const double share = of_arm / stop.tau;
    const double of_velocity = settings_.correction * stop.tau / period;  // that goes in this period
    double hardness = std::min(hardness_of_stop(distance_left, std::max(u, of_arm), c, stop.tau), of_velocity);
    if (hardness <= 1.0) {
      return std::min(required, share);
    }
    if (required > now) {
      hardness = share > 0.0 ? std::min(hardness, 2.0 * required / share) : hardness;
      required = std::min({required, hardness * share, lasts ? now : infinity});
      if (net <= 0.0 && hardness > stop.hardest) {
        stop.hardest = hardness;
        stop.row = row;
      }
    }
    return required;
  }
  if (required > now && lasts) {
    return now;
  }
  if (distance_left <= 0.0 && required > now && net > 0.0) {
    // For the approach, not for recovery.
    return std::min(required, std::max(now, settings_.correction * u / period - c));
  }
  return required;
}

double ClearanceConstraints::with_jerk(double asked, const Closing& closing, int row, ConstVectorRef gradient,
                                       const BrakingState& state, PathStop& stop) noexcept {
  const LastMotion& last = *state.last;
  const double whole = last.jerk_share * gradient.cwiseAbs().dot(state.limits.jerk);
  if (whole < infinity && (closing.distance_left <= 0.0 || closing.u <= closing.of_arm + slow)) {
    Reserve& reserve = reserves_[static_cast<std::size_t>(row)];
    const double jerk = closing.distance_left > 0.0 ? last.jerk_share * closing.of_arm * stop.jerk : whole;
    reserve.hardest = stop.tau > 0.0 ? closing.of_arm / stop.tau : 0.0;
    reserve.jerk = of_jerk_alone * jerk;
    reserve.before = gradient.dot(last.acceleration);
  }
  double required = smoothed(asked, closing.distance_left, closing.u, closing.c, of_hardest * closing.hardest, gradient, last,
                             state.bounds, state.limits, state.period);
  const bool smooth = required < asked;
  // At most what the torque rate allows next: more would fling light joints about for little effect.
  if (state.torque != nullptr && last.rates != nullptr && required == asked && asked > last.acceleration.dot(gradient)) {
    required = within_rates(gradient, required, *last.rates);
  }
  if (stop.row == row && smooth) {
    stop.row = -1;
    stop.hardest = 0.0;
  }
  return required;
}

double ClearanceConstraints::within_rates(ConstVectorRef direction, double asked, const RateLimits& rates) noexcept {
  return std::min(asked, braking_.largest_by_both(direction, rates.acceleration_lower, rates.acceleration_upper,
                                                  rates.torque_lower, rates.torque_upper, asked));
}

double ClearanceConstraints::smoothed(double required, double distance_left, double u, double c, double A,
                                      ConstVectorRef gradient, const LastMotion& last, const AccelerationBounds& bounds,
                                      const JointLimits& limits, double period) noexcept {
  const double jerk = last.jerk_share * gradient.cwiseAbs().dot(limits.jerk);
  if (!(jerk < infinity)) {
    return required;
  }
  const double before = gradient.dot(last.acceleration);
  const double least = -largest_product(-gradient, bounds.smooth_lower, bounds.smooth_upper);
  const double most = largest_product(gradient, bounds.smooth_lower, bounds.smooth_upper);  // joints at a limit give no more
  const auto raised = [&](double share) { return std::min(before + share * std::max(most - before, 0.0), most); };
  const double lasting = last.early ? std::min(c, 0.0) : c;
  const auto stops = [&](double x, double share) {
    return smooth_stop_fits(distance_left, u, x + lasting, A, share * jerk, period);
  };
  const double shared = raised(of_jerk), alone = raised(of_jerk_alone);
  if (!last.lost && distance_left <= 0.0 && u <= creeping) {  // The clearance does not close: recovery respects the jerk limit.
    return std::min(required, alone);
  }
  const bool enough = stops(shared, of_jerk);
  if (required > shared) {
    return enough ? shared : stops(alone, of_jerk_alone) ? std::min(required, alone) : required;
  }
  if (!last.early || distance_left <= 0.0) {
    return required;
  }
  const double part = enough ? of_jerk : of_jerk_alone;
  double low = enough ? std::max(required, least) : shared, high = enough ? shared : alone;
  if (low < high && !stops(low, part) && !stops(high, part)) {
    return high;
  }
  return least_that_fits(low, high, [&](double x) { return stops(x, part); });
}

}  // namespace sidestep
