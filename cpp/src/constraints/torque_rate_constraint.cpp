#include "sidestep/constraints/torque_rate_constraint.hpp"

#include <cmath>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {

double jerk_share(const Eigen::MatrixXd& mass, const JointLimits& limits, double rate_share) noexcept {
  // Share of the rate for |M j| T [-]: the rest is for the change of the bias.
  const double of_rate = 0.8 * rate_share;
  double share = 1.0;
  for (Eigen::Index i = 0; i < mass.rows(); ++i) {
    double most = 0.0;
    for (Eigen::Index j = 0; j < mass.cols(); ++j) {
      if (std::isfinite(limits.jerk[j])) {
        most += std::abs(mass(i, j)) * limits.jerk[j];
      }
    }
    if (most * share > of_rate * limits.effort_rate[i]) {
      share = of_rate * limits.effort_rate[i] / most;
    }
  }
  return share;
}

TorqueRateConstraint::TorqueRateConstraint(JointLimits limits) : limits_(std::move(limits)) {}

void TorqueRateConstraint::append(const Moment& now, Bounds& bounds, RowBlock&) noexcept {
  if (now.last.torque == nullptr) {
    return;
  }
  for (Eigen::Index i = 0; i < limits_.effort_rate.size(); ++i) {
    const double before = (*now.last.torque)[i] - now.dynamics->bias[i];
    const double step = limits_.effort_rate[i] * now.torque_period;
    if (step < infinity) {
      bounds.torque.narrow(i, before - step, before + step, Limit::torque_rate_lower, Limit::torque_rate_upper);
    }
  }
}

}  // namespace sidestep
