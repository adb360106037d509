#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

constexpr double bound_rounding = 1e-9;  // [rad/s] or [m/s] by which a bound counts as kept

/// How far the velocity of a frame may be from the twist that was asked for and count as the same; translation and rotation
/// each. Joints: see joint_tolerance.
struct InputTolerance {
  static constexpr double share = 0.05;  // Share of what is asked [-].
  // A turn of 1 rad/s may move the frame's origin as 0.1 m/s may, a translation of 1 m/s may turn it as 1 rad/s may.
  static constexpr double metres_per_turn = 0.1, turns_per_metre = 1.0;  // [m/rad], [rad/m]
  static constexpr double least_linear = 5e-4, least_angular = 1e-3;     // [m/s], [rad/s]: rest

  double linear, angular;  ///< [m/s], [rad/s]

  static InputTolerance of(const Vector6d& twist) noexcept {
    const double speed = twist.head<3>().norm(), rate = twist.tail<3>().norm();
    return {share * std::max(speed, metres_per_turn * rate), share * std::max(rate, turns_per_metre * speed)};
  }
  /// The longest multiple of a direction (6) that is within it.
  double along(const Vector6d& direction) const noexcept {
    return std::min(linear / std::max(1e-12, direction.head<3>().norm()),
                    angular / std::max(1e-12, direction.tail<3>().norm()));
  }
  bool holds(const Vector6d& error) const noexcept {
    return error.head<3>().norm() <= linear + least_linear && error.tail<3>().norm() <= angular + least_angular;
  }
};

/// What makes a velocity or twist smaller than asked, before the program.
struct Reduction {
  enum class By { nothing, speed, joint, singular };

  By by = By::nothing;
  double share = 1.0;                ///< of a twist that is left, in [0, 1]
  Eigen::Index joint = -1;           ///< whose velocity limit, or whose position limit
  bool upper = false;                ///< the upper position limit
  Vector6d lost = Vector6d::Zero();  ///< unit direction in which the frame hardly moves, on the side that was asked for
};

/// Limits that velocities, twists and trajectories may use of each joint; the rest is for feedback.
struct UsableLimits {
  Eigen::VectorXd velocity, acceleration;  ///< (nv) [rad/s | m/s] and per s

  /// Scales a velocity as a whole to the limits, and writes which joint asks for that; the share that is left.
  double scale(Eigen::VectorXd& v, Reduction& reduction) const noexcept;
};

/// [rad/s | m/s] By how much joint j may be off a velocity of all and count as following it.
double joint_tolerance(const Eigen::VectorXd& asked, Eigen::Index j, bool slides) noexcept;

}  // namespace sidestep
