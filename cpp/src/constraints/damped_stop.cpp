#include "sidestep/constraints/damped_stop.hpp"

#include <algorithm>
#include <cmath>

#include "../math/cholesky.hpp"

namespace sidestep {
namespace {

// Damping of the stop for joints without an effort or a velocity limit to derive it from [Nm s/rad | N s/m].
constexpr double unlimited_stop_damping = 1.0;

/// Clips joint i's torque to what effort and rate leave, and names the limit.
void clip_torque(const DampedStop::State& state, Eigen::Index i, MotionSolution& solution) noexcept {
  const double effort = state.limits.effort[i];
  double lower = -effort, upper = effort;
  if (state.last_torque != nullptr) {
    const double before = (*state.last_torque)[i], step = state.limits.effort_rate[i] * state.torque_period;
    lower = std::clamp(before - step, -effort, effort);
    upper = std::clamp(before + step, -effort, effort);
  }
  const double wanted = solution.torque[i];
  solution.torque[i] = std::clamp(std::isfinite(wanted) ? wanted : 0.0, lower, upper);
  if (solution.torque[i] != wanted) {
    const bool up = !(wanted <= 0.0), by_rate = up ? upper < effort : lower > -effort;
    solution.active[static_cast<std::size_t>(i)] =
        by_rate ? (wanted > solution.torque[i] ? Limit::torque_rate_upper : Limit::torque_rate_lower)
        : up    ? Limit::torque_upper
                : Limit::torque_lower;
  }
}

}  // namespace

void DampedStop::apply(const State& state, MotionSolution& solution) const noexcept {
  const JointLimits& limits = state.limits;
  const Eigen::Index nv = solution.torque.size();
  solution.slack.setZero();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  solution.torque = state.dynamics.bias;
  for (Eigen::Index j = 0; j < nv; ++j) {
    if (state.mass_known) {
      const double wanted = std::clamp(-state.velocity[j] / time, -limits.acceleration[j], limits.acceleration[j]);
      const bool bounded = solution.lower[j] <= solution.upper[j];  // not without a position
      const double braking = bounded ? std::clamp(wanted, solution.lower[j], solution.upper[j]) : wanted;
      solution.torque += braking * state.dynamics.mass.col(j);
    } else {
      const double derived = damping * limits.effort[j] / limits.velocity[j];
      solution.torque[j] -= (std::isfinite(derived) && derived > 0.0 ? derived : unlimited_stop_damping) * state.velocity[j];
    }
  }
  for (Eigen::Index i = 0; i < nv; ++i) {
    clip_torque(state, i, solution);
  }
  if (state.mass_known) {
    solution.acceleration = solution.torque - state.dynamics.bias;
    solve_in_place(state.dynamics.mass_cholesky, solution.acceleration);
  }
}

}  // namespace sidestep
