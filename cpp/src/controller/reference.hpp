#pragma once

#include <Eigen/Core>

#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/robot.hpp"
#include "tick.hpp"

namespace sidestep {

/// The motion that the controller integrates and the arm tracks [rad | m] and its derivatives (nv each):
///   q̇⁺ = q̇ + T q̈,   q⁺ = q + T q̇⁺.
struct Reference {
  explicit Reference(Eigen::Index nv)
      : q(Eigen::VectorXd::Zero(nv)), v(q), a(q), smooth_a(q), next_q(q), next_v(q), torque(q) {}

  /// The next period begins with an arm at q, velocity v (nv); nothing is known of an acceleration. `stops`: drives that are on the
  /// way back to an old command stop with the new one.
  void begin(const Eigen::VectorXd& at, const Eigen::VectorXd& velocity, bool stops) noexcept;
  /// Corrects the end of this period where the next step came earlier or later than expected: what was commanded is held until then.
  /// An acceleration or torque moved the arm on by q̇⁺ = q̇ + t q̈, q⁺ = q + t q̇ + t (t + T)/2 q̈ in the time t, where samples are T
  /// apart; a velocity by t q̇⁺; at a position that is commanded the arm stays.
  void hold(ControllerSettings::Output output, const Tick& tick) noexcept;
  /// The next period begins where drives say that they go on from (nv each).
  void continue_from(const Eigen::VectorXd& position, const Eigen::VectorXd& velocity,
                     const Eigen::VectorXd& acceleration) noexcept {
    next_q = position;
    next_v = velocity;
    a = smooth_a = acceleration;
  }
  /// The next period begins where this one ends.
  void go_on() noexcept {
    q = next_q;
    v = next_v;
  }
  /// Slows a motion that begins at (q, v) down to what can be braked within the limits, see `viable_velocity`. An arm that something
  /// flings can be faster: feedback brakes it.
  void keep_viable(const JointLimits& limits, const ControllerSettings& settings, double period) noexcept;
  /// Integrates over the period T [s]; an acceleration that is not finite leaves that of the period before.
  /// `rises`: the acceleration goes beyond the jerk limits [/s³]; the next ones go on from what jerk allows.
  void advance(const Eigen::VectorXd& acceleration, bool rises, const Eigen::VectorXd& jerk, double period) noexcept;

  Eigen::VectorXd q, v;            ///< at the beginning of this period
  Eigen::VectorXd a;               ///< in this period, and in the last one until `advance`
  Eigen::VectorXd smooth_a;        ///< from which jerk goes on
  Eigen::VectorXd next_q, next_v;  ///< at its end
  Eigen::VectorXd torque;          ///< that its program gave last [Nm | N]
};

}  // namespace sidestep
