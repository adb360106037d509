#pragma once

#include "sidestep/constraints/constraint.hpp"

namespace sidestep {

/// Effort limits and rate once more for the torque without gravity, as drives that hold the arm themselves are told less.
class GravityTorqueConstraint : public Constraint {
 public:
  explicit GravityTorqueConstraint(JointLimits limits);

  Priority priority() const noexcept override { return Priority::never; }
  int max_rows() const noexcept override { return 0; }
  void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept override;

 private:
  JointLimits limits_;
};

}  // namespace sidestep
