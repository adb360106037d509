#pragma once

#include "sidestep/constraints/constraint.hpp"

namespace sidestep {

/// Effort limits: |M q̈ + h| <= effort.
class TorqueConstraint : public Constraint {
 public:
  explicit TorqueConstraint(JointLimits limits);

  Priority priority() const noexcept override { return Priority::never; }
  int max_rows() const noexcept override { return 0; }
  void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept override;
  /// Clamps a torque that exceeds its limit by rounding.
  bool admit(MotionSolution& solution) const noexcept override;

 private:
  JointLimits limits_;
};

}  // namespace sidestep
