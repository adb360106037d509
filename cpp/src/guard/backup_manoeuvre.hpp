#pragma once

#include <Eigen/Core>

#include "checked_places.hpp"
#include "sidestep/guard/stop_trajectory.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep {

/// Torque of a stop, M a + h, with the mass matrix M and the bias h (Coriolis, centrifugal and gravity forces) of now.
struct StopTorque {
  const Eigen::MatrixXd& mass;  ///< Mass matrix M (nv × nv).
  const Eigen::VectorXd& bias;  ///< Bias h (nv) [Nm | N].
  double jerk_share;            ///< Share of the jerk limits with which torques keep their rate limits [-].

  /// Writes M a + h (nv).
  void of(const Eigen::VectorXd& a, Eigen::VectorXd& torque) const noexcept;
};

/// The motion at the begin of a period.
struct GuardedMotion {
  const Eigen::VectorXd& q;     ///< State (nv) [rad | m].
  const Eigen::VectorXd& v;     ///< Velocity (nv) [/s].
  const Eigen::VectorXd& last;  ///< Acceleration (nv) [/s²] of the period before.
  double period;                ///< Length of the coming period [s].
  bool as_expected = true;      ///< The state is where the last acceleration leads in the last period: else it was held longer.
};

/// Moves on only after it has verified a collision-free stop within all limits; otherwise it takes the stop verified before. So
/// jerk and acceleration limits hold among obstacles at rest: no clearance has to be met by a demand that comes too late.
///
/// A stop is free if every clearance, of obstacles and of the arm's own links, stays above its floor. A floor is a fifth of the
/// margin, or the clearance when the first stop was found, if that was smaller. CheckedPlaces proves it along the stop: between
/// two checks a clearance stays above its floor or, where the distance left is smaller than the floor, above zero.
///
/// With slow torques stops are long. Where none is found, the search pauses for a few periods, since it takes long.
///
/// One thread at a time; nothing here allocates after construction.
class BackupManoeuvre {
 public:
  /// `body`, which stays; `limits` of the motion; `margin` of clearances [m].
  BackupManoeuvre(const ClearanceQuery& body, const JointLimits& limits, double margin);

  /// Forgets the known stop: the state was not reached by what `keep` returned, or something moves.
  void reset() noexcept {
    known_ = false;
    places_.clear();
  }
  /// The obstacles are others, or have moved: places are checked again when they are needed, a few in each step.
  void invalidate() noexcept;

  /// Replaces the wanted acceleration `a` (nv) [/s²] if no free stop follows it, and returns whether it did.
  ///
  /// `torque`: null for motion without torque. If `a` changes faster than
  /// the limits allow, only the allowed share of the change is made. If a free stop follows, that is the result. Otherwise it is
  /// the known stop, or one from here. `a` passes unverified if no stop is known and it is within the limits, if the known stop is
  /// over, and if there is no stop at all.
  /// Where the state is another than expected, or the period changes, the known stop is replaced by one from here.
  bool keep(const GuardedMotion& now, const Obstacles& obstacles, const StopTorque* torque, Eigen::VectorXd& a) noexcept;

 private:
  /// Share of the change from `last` to `a` with which acceleration and jerk keep their limits, in [0, 1].
  double smooth_share(const GuardedMotion& now, const Eigen::VectorXd& a) const noexcept;
  /// Writes the acceleration of the known stop, or else of one from here; false if there is none.
  bool stop_instead(const GuardedMotion& now, const Obstacles& obstacles, const StopTorque* torque,
                    Eigen::VectorXd& a) noexcept;
  /// Plans a stop; false if none is within the limits.
  bool plan(const GuardedMotion& from, const StopTorque* torque) noexcept;
  /// Plans a stop, and takes it as the known one if it is free; false if not.
  bool find_stop(const GuardedMotion& from, const Obstacles& obstacles, const StopTorque* torque) noexcept;
  bool is_within_effort(const Eigen::VectorXd& a, const StopTorque& torque) noexcept;
  bool is_free(const StopTrajectory& stop, const Obstacles& obstacles) noexcept;
  void set_floors(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept;

  const ClearanceQuery& body_;
  ClearanceQuery::Workspace workspace_;
  const JointLimits limits_;
  JointLimits slowed_;                // Limits with less acceleration.
  const double floor_, spacing_;      // Usual floor [m], and motion between two checks [m].
  StopTrajectory stop_, next_stop_;   // The known stop, from here; one from the end of this period.
  bool known_ = false, low_ = false;  // Whether a stop is known; whether a floor is below the usual one.
  Eigen::VectorXd next_q_, next_v_, next_a_, q_, next_place_, a_, force_;
  Eigen::VectorXd clearances_, floors_, last_floors_;  // One per item of the body [m].
  CheckedPlaces places_;
  int rechecking_ = 0;  // Steps left in which a known stop is checked again.
  int pause_ = 0;       // Steps left in which no stop is searched.
};

}  // namespace sidestep
