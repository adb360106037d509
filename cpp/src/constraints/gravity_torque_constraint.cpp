#include "sidestep/constraints/gravity_torque_constraint.hpp"

#include <cmath>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {

GravityTorqueConstraint::GravityTorqueConstraint(JointLimits limits) : limits_(std::move(limits)) {}

void GravityTorqueConstraint::append(const Moment& now, Bounds& bounds, RowBlock&) noexcept {
  const LastCommand& last = now.last;
  if (last.gravity == nullptr) {
    return;
  }
  constexpr Limit lower = Limit::torque_rate_lower, upper = Limit::torque_rate_upper;
  for (Eigen::Index i = 0; i < limits_.effort.size(); ++i) {
    const double effort = limits_.effort[i], bias = now.dynamics->bias[i], g = (*last.gravity)[i];
    if (std::abs(g) < effort) {
      bounds.torque.narrow(i, -effort - bias + g, effort - bias + g, lower, upper);
    }
    const double step = last.torque == nullptr ? infinity : limits_.effort_rate[i] * now.torque_period;
    if (step < infinity && last.gravity_change != nullptr) {
      const double before = (*last.torque)[i] - bias, change = (*last.gravity_change)[i];
      bounds.torque.narrow(i, before + change - step, before + change + step, lower, upper);
    }
  }
}

}  // namespace sidestep
