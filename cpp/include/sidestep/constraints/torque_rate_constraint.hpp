#pragma once

#include "sidestep/constraints/constraint.hpp"

namespace sidestep {

/// Share of the jerk limits with which no torque exceeds its rate, for any motion of the joints; M (nv, nv). 1 without a rate.
double jerk_share(const Eigen::MatrixXd& mass, const JointLimits& limits, double rate_share = 1.0) noexcept;

/// Rate of torque: |torque − last torque| <= effort rate · T, as far as effort allows.
class TorqueRateConstraint : public Constraint {
 public:
  explicit TorqueRateConstraint(JointLimits limits);

  Priority priority() const noexcept override { return Priority::never; }
  int max_rows() const noexcept override { return 0; }
  void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept override;

 private:
  JointLimits limits_;
};

}  // namespace sidestep
