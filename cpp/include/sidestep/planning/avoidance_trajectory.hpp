#pragma once

#include <Eigen/Core>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// A motion to rest at a configuration, each joint as fast as its limits allow, and the acceleration that follows it.
///
/// Every joint has a reference of its own. In a period T it goes from the speed v towards the target to the largest w
/// from which it still stops there with the deceleration A,
///     w²/2A + T w/2 + T (v + w)/2 <= distance left,    |w − v| <= A T,    w <= V
/// (the first two terms bound a stop in whole periods: it ends at the target, not beyond). A and V are nine tenths of the
/// joint's acceleration limit (90 /s² without one) and velocity limit; the rest is for feedback. The reference q*, v*, a* is
/// followed with a* + ω² (q* − q) + 2ω (v* − v), ω = 10 /s.
///
/// Obstacles are ignored here: the acceleration is for a MotionProgram with clearances.
class AvoidanceTrajectory {
 public:
  /// From q at velocity v (nv) to rest at `target` (nv).
  AvoidanceTrajectory(const JointLimits& limits, const Eigen::VectorXd& q, const Eigen::VectorXd& v, Eigen::VectorXd target);

  /// The acceleration (nv) [/s²] that follows the reference from q, v for a period [s] > 0.
  Eigen::VectorXd acceleration(ConstVectorRef q, ConstVectorRef v, double period) const;
  /// The same into `out` (nv). No allocation.
  void acceleration(ConstVectorRef q, ConstVectorRef v, double period, Eigen::Ref<Eigen::VectorXd> out) const noexcept;

  /// Moves the reference on by a period [s] > 0.
  void advance(double period) noexcept;

  const Eigen::VectorXd& target() const noexcept { return target_; }
  /// The reference [rad | m, /s].
  const Eigen::VectorXd& position() const noexcept { return position_; }
  const Eigen::VectorXd& velocity() const noexcept { return velocity_; }

 private:
  double reference_acceleration(Eigen::Index joint, double period) const noexcept;

  Eigen::VectorXd fastest_, hardest_;  // V and A of each joint.
  Eigen::VectorXd target_, position_, velocity_;
};

}  // namespace sidestep
