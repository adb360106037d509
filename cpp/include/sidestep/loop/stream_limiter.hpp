#pragma once

#include <Eigen/Core>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Limits of a robot that checks each command of a stream against the commands before it, and stops itself where one breaks them.
struct StreamLimits {
  JointLimits joints;
  /// (nv) Near its position limits a joint is allowed min(v_max, max(0, √(2 D (q_max − q)) − o)), and the same at the other end:
  /// D [rad/s²], o [rad/s]. Empty: the velocity limit is the same everywhere.
  Eigen::VectorXd end_deceleration = {}, end_offset = {};
  double margin = 0.05;  ///< share of every limit that stays unused: what a robot says is rounded to single precision
};

/// The command nearest to the wanted one that the robot accepts, given what it goes on from.
///
/// A robot that interpolates a stream at the period T judges the next position p⁺ by backward differences:
///   v⁺ = (p⁺ − p)/T,   a⁺ = (v⁺ − v)/T,   j = (a⁺ − a)/T,   |j| ≤ J, |a⁺| ≤ A, v⁻(p) ≤ v⁺ ≤ v⁺_max(p).
/// Where a command does not reach it in time it goes on by itself, so p, v, a are what it says that it was told, not what was sent.
///
/// Positions: from the error e of the robot's reference to the wanted one at the beginning of the period,
///   a* = a_w + 2 ω ė + ω² e,   p⁺ = p + T (v + T a⁺),   a⁺ = a* within the limits above.
/// Velocities: from e = v_w − v − T a_w, a* = a_w + b(e): the largest b that jerk brings back to 0 before e is used up,
///   n b T − J T² n (n − 1)/2 = |e|,   n: periods that it takes.
/// The same b keeps both from a velocity limit. Torques: within their limits, and T times their rate from what
/// the robot holds and from what was sent last, as that may still be on its way.
/// A wanted command within the limits, of a robot that was told the one before, is sent as it is.
class StreamLimiter {
 public:
  /// Position, velocity and acceleration of a reference (nv each).
  struct Motion {
    const Eigen::VectorXd &position, &velocity, &acceleration;
  };

  /// Throws std::invalid_argument that names the value and what is allowed.
  StreamLimiter(StreamLimits limits, double period);

  /// A stream begins: the robot rests at `position` and holds `torque` (nv).
  void begin(const Eigen::VectorXd& position, const Eigen::VectorXd& torque) noexcept;
  /// `told`: what the robot goes on from; an entry that is NaN: what was sent. `wanted`: at the end of this period. Returns what to
  /// send (nv); valid until the next call.
  const Eigen::VectorXd& limit_positions(const Motion& told, const Motion& wanted) noexcept;
  /// The same of velocities; positions only tell how far the ends are.
  const Eigen::VectorXd& limit_velocities(const Motion& told, const Motion& wanted) noexcept;
  /// The same of torques.
  const Eigen::VectorXd& limit_torques(const Eigen::VectorXd& told, const Eigen::VectorXd& wanted) noexcept;

  Eigen::Index size() const noexcept { return p_.size(); }  ///< nv
  /// Largest difference of a joint between the last command and the wanted one [rad | m, /s or Nm | N].
  double change() const noexcept { return change_; }

 private:
  void take(const Motion& told) noexcept;
  double within(Eigen::Index j, double acceleration) const noexcept;
  double largest_towards(Eigen::Index j, double side) const noexcept;
  double kept_below(Eigen::Index j, double limit, double falls, double v) const noexcept;
  double braked(double jerk, double left) const noexcept;
  void accelerate(Eigen::Index j, double acceleration) noexcept;

  StreamLimits limits_;
  double period_, share_, change_ = 0.0;
  Eigen::VectorXd p_, v_, a_, torque_;  // of the last command, or as the robot says
};

}  // namespace sidestep
