#include "reference.hpp"

#include <algorithm>
#include <cmath>

#include "sidestep/constraints/acceleration_bounds.hpp"

namespace sidestep {
namespace {

constexpr double jitter = 0.1;  // measured velocities of an arm at rest, at most [rad/s | m/s]

}  // namespace

void Reference::begin(const Eigen::VectorXd& at, const Eigen::VectorXd& velocity, bool stops) noexcept {
  for (Eigen::Index j = 0; j < at.size(); ++j) {
    const double speed = std::abs(velocity[j]) < jitter ? 0.0 : velocity[j];
    next_v[j] = stops && (next_q[j] - at[j]) * speed > 0.0 ? 0.0 : speed;
    next_q[j] = at[j];
  }
  a.setZero();
  smooth_a.setZero();
}

void Reference::hold(ControllerSettings::Output output, const Tick& tick) noexcept {
  const double t = tick.held, T = tick.expected;
  if (tick.is_as_expected() || output == ControllerSettings::Output::position) {
    return;
  }
  if (output == ControllerSettings::Output::velocity) {
    next_q = q + t * next_v;
    return;
  }
  next_v = v + t * a;
  next_q = q + t * v + 0.5 * t * (t + T) * a;
}

void Reference::keep_viable(const JointLimits& limits, const ControllerSettings& settings, double period) noexcept {
  const double margin = settings.position_margin, share = 1.0 - settings.limit_margin;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    v[j] = viable_velocity(
        q[j], v[j], {limits.lower[j] + margin, limits.upper[j] - margin, limits.velocity[j], share * limits.acceleration[j]},
        period);
  }
}

void Reference::advance(const Eigen::VectorXd& acceleration, bool rises, const Eigen::VectorXd& jerk, double period) noexcept {
  if (acceleration.allFinite()) {
    a = acceleration;
  }
  if (rises) {
    // A push out of what is lost ends as suddenly as it began.
    for (Eigen::Index j = 0; j < a.size(); ++j) {
      const double step = jerk[j] * period;
      smooth_a[j] += std::clamp(a[j] - smooth_a[j], -step, step);
    }
  } else {
    smooth_a = a;
  }
  next_v = v + period * a;
  next_q = q + period * next_v;
}

}  // namespace sidestep
