#pragma once

#include "sidestep/constraints/constraint.hpp"

namespace sidestep {

struct JointLimitSettings {
  double position_margin = 0.0;   ///< Distance by which position limits are moved inwards [rad | m].
  double velocity_overrun = 1.2;  ///< Factor up to which velocity limits give way to clearances and torque, in [1, inf) [-].
  double acceleration_overrun = 10.0;  ///< Factor up to which acceleration limits give way, in [1, inf) [-].
  bool hard = false;                   ///< Whether velocity and acceleration limits never give way.
};

/// Joint box: limits of position, velocity, acceleration and jerk (see acceleration_bounds.hpp).
class JointLimitConstraint : public Constraint {
 public:
  JointLimitConstraint(JointLimits limits, JointLimitSettings settings);

  Priority priority() const noexcept override { return Priority::comfort; }
  int max_rows() const noexcept override { return 0; }
  void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept override;
  bool bounds_stop() const noexcept override { return true; }
  /// jerk: to the limits themselves; of feedback to the overruns, of an impedance to its factor alone. comfort: to the overruns.
  void widen(Priority given_up, const Moment& now, Bounds& bounds) const noexcept override;
  /// Names the jerk limits that gave way.
  void report(const Moment& now, const Bounds& bounds, const RowBlock& rows, const Eigen::VectorXd& wanted,
              MotionSolution& solution) const noexcept override;

 private:
  static void widen_to_limits(Bounds& bounds) noexcept;
  void widen_to_overruns(const Moment& now, Bounds& bounds) const noexcept;

  JointLimits limits_;
  JointLimits tighter_;  // Limits of this solve.
  JointLimitSettings settings_;
};

}  // namespace sidestep
