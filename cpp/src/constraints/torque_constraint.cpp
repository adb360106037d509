#include "sidestep/constraints/torque_constraint.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sidestep {
namespace {

// Excess of an effort limit that is rounding, as a fraction of the limit: a program with more is not solved.
constexpr double torque_tolerance = 1e-6;

}  // namespace

TorqueConstraint::TorqueConstraint(JointLimits limits) : limits_(std::move(limits)) {}

void TorqueConstraint::append(const Moment& now, Bounds& bounds, RowBlock&) noexcept {
  bounds.torque.lower = -limits_.effort - now.dynamics->bias;
  bounds.torque.upper = limits_.effort - now.dynamics->bias;
  std::fill(bounds.torque.lower_limit.begin(), bounds.torque.lower_limit.end(), Limit::torque_lower);
  std::fill(bounds.torque.upper_limit.begin(), bounds.torque.upper_limit.end(), Limit::torque_upper);
}

bool TorqueConstraint::admit(MotionSolution& solution) const noexcept {
  for (Eigen::Index i = 0; i < solution.torque.size(); ++i) {
    const double effort = limits_.effort[i];
    if (!(std::abs(solution.torque[i]) <= effort * (1.0 + torque_tolerance))) {
      return false;
    }
    solution.torque[i] = std::clamp(solution.torque[i], -effort, effort);
  }
  return true;
}

}  // namespace sidestep
