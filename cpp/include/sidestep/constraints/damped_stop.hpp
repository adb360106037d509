#pragma once

#include "sidestep/constraints/constraint.hpp"

namespace sidestep {

/// Stop of the arm if no program can be solved: torque = M a + h with a = −v/time within the bounds, clipped to the effort and
/// torque rate limits. Without a usable mass matrix, h − D v, clipped.
struct DampedStop {
  double time = 0.1;      ///< Time constant [s].
  double damping = 0.25;  ///< Joint damping without a mass matrix, in units of effort limit / velocity limit [-].

  struct State {
    double torque_period;  ///< see Moment
    const JointLimits& limits;
    const Eigen::VectorXd& velocity;
    const Eigen::VectorXd* last_torque;
    const BrakingTorque& dynamics;
    bool mass_known;
  };
  /// Reads the bounds in the solution; writes torque, acceleration and active limits.
  void apply(const State& state, MotionSolution& solution) const noexcept;
};

}  // namespace sidestep
