#include "sidestep/constraints/joint_limit_constraint.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../math/settings.hpp"
#include "tolerances.hpp"

namespace sidestep {

JointLimitConstraint::JointLimitConstraint(JointLimits limits, JointLimitSettings settings)
    : limits_(std::move(limits)), tighter_(limits_), settings_(settings) {}

void JointLimitConstraint::append(const Moment& now, Bounds& bounds, RowBlock&) noexcept {
  const LastCommand& last = now.last;
  tighter_.velocity = now.speed_share * limits_.velocity;
  constexpr double most = 0.25;  // of the way between a joint's limits
  for (Eigen::Index i = 0; i < tighter_.lower.size(); ++i) {
    const double way = std::isfinite(limits_.velocity[i]) ? now.inside * limits_.velocity[i] : 0.0;
    const double inside = std::min(way, most * (limits_.upper[i] - limits_.lower[i]));
    tighter_.lower[i] = limits_.lower[i] + inside;
    tighter_.upper[i] = limits_.upper[i] - inside;
  }
  bounds.box.update(tighter_, now.position, now.velocity, now.period,
                    {settings_.position_margin, now.jerk_share, last.acceleration_factor},
                    last.binds ? last.acceleration : nullptr);
  if (last.acceleration_factor > 1.0 && now.wanted != nullptr) {
    bounds.box.draw_in(limits_.acceleration, *now.wanted);
  }
  if (now.keeps_torque_rate && !now.found.lost() && last.acceleration != nullptr && last.binds) {
    bounds.firm_jerk.lower = *last.acceleration - now.period * limits_.jerk;
    bounds.firm_jerk.upper = *last.acceleration + now.period * limits_.jerk;
  } else {
    bounds.firm_jerk.lower.setConstant(-infinity);
    bounds.firm_jerk.upper.setConstant(infinity);
  }
}

void JointLimitConstraint::widen(Priority given_up, const Moment& now, Bounds& bounds) const noexcept {
  const bool is_feedback = now.last.torque != nullptr && now.last.acceleration_factor > 1.0;
  if (given_up != Priority::jerk || (is_feedback && !now.last.yields)) {
    widen_to_overruns(now, bounds);
  } else if (is_feedback) {
    bounds.wide.upper = now.last.acceleration_factor * limits_.acceleration;
    bounds.wide.lower = -bounds.wide.upper;
  } else {
    widen_to_limits(bounds);
  }
}

void JointLimitConstraint::widen_to_limits(Bounds& bounds) noexcept {
  bounds.wide.lower = bounds.firm_jerk.lower.cwiseMax(bounds.box.lower).cwiseMin(bounds.box.upper);
  bounds.wide.upper = bounds.firm_jerk.upper.cwiseMin(bounds.box.upper).cwiseMax(bounds.box.lower);
}

void JointLimitConstraint::widen_to_overruns(const Moment& now, Bounds& bounds) const noexcept {
  const AccelerationBounds& box = bounds.box;
  bounds.wide.lower = box.lower;
  bounds.wide.upper = box.upper;
  if (settings_.hard) {
    return;
  }
  // Neither position limits nor, where torques change at a limited rate, what could not be taken back in time go beyond the
  // overruns. Feedback has its own factor.
  for (Eigen::Index i = 0; i < now.position.size(); ++i) {
    const double position = now.position[i], velocity = now.velocity[i];
    const double most = std::max(settings_.acceleration_overrun, now.last.acceleration_factor) * limits_.acceleration[i];
    const double fastest = settings_.velocity_overrun * tighter_.velocity[i];
    double upper = std::clamp((fastest - velocity) / now.period, -most, most);
    double lower = std::clamp((-fastest - velocity) / now.period, -most, most);
    const double jerk = now.jerk_share * limits_.jerk[i];
    if (limits_.effort_rate[i] < infinity && jerk < infinity) {
      const ScalarLimits limits{tighter_.lower[i] + settings_.position_margin, tighter_.upper[i] - settings_.position_margin,
                                fastest, limits_.acceleration[i]};
      const double up = largest_returnable(limits.upper - position, velocity, lower, upper, limits, jerk, now.period).value;
      const double down =
          -largest_returnable(position - limits.lower, -velocity, -upper, -lower, limits, jerk, now.period).value;
      if (down <= up) {
        lower = std::clamp(down, lower, upper);
        upper = std::clamp(up, lower, upper);
      }
    }
    const double position_lower = std::min(box.position_lower[i], upper);
    const double position_upper = std::max(box.position_upper[i], lower);
    if (position_lower <= position_upper) {
      lower = std::max(lower, position_lower);
      upper = std::min(upper, position_upper);
    }
    bounds.wide.lower[i] = std::clamp(bounds.firm_jerk.lower[i], lower, upper);
    bounds.wide.upper[i] = std::clamp(bounds.firm_jerk.upper[i], lower, upper);
  }
}

void JointLimitConstraint::report(const Moment& now, const Bounds& bounds, const RowBlock&, const Eigen::VectorXd&,
                                  MotionSolution& solution) const noexcept {
  if (now.last.acceleration == nullptr || !now.last.binds) {
    return;
  }
  const AccelerationBounds& box = bounds.box;
  for (Eigen::Index i = 0; i < solution.acceleration.size(); ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const double x = solution.acceleration[i], rounding = slack_tolerance * (1.0 + std::abs(x));
    if (x > box.smooth_upper[i] + rounding && box.smooth_upper_limit[joint] == Limit::jerk_upper) {
      solution.active[joint] = solution.active[joint] | Limit::jerk_upper;
    } else if (x < box.smooth_lower[i] - rounding && box.smooth_lower_limit[joint] == Limit::jerk_lower) {
      solution.active[joint] = solution.active[joint] | Limit::jerk_lower;
    }
  }
}

}  // namespace sidestep
