#pragma once

#include <Eigen/Core>
#include <limits>

#include "sidestep/clearance/clearances.hpp"
#include "sidestep/constraints/constraint_rows.hpp"
#include "sidestep/constraints/motion_solution.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// Command of the last period, for the limits of jerk and torque rate; null: the limit does not apply.
struct LastCommand {
  const Eigen::VectorXd* acceleration = nullptr;  ///< Acceleration (nv) [/s^2].
  const Eigen::VectorXd* torque = nullptr;        ///< Torque (nv) [Nm | N].
  /// Gravity part of the bias now (nv), and below its change since then [Nm | N]. Effort and its rate keep their limits with
  /// and without it, since drives that hold the arm themselves are told less.
  const Eigen::VectorXd* gravity = nullptr;
  const Eigen::VectorXd* gravity_change = nullptr;
  /// Factor up to which feedback may exceed the acceleration limits, in [1, inf) [-].
  double acceleration_factor = 1.0;
  bool binds = true;  ///< Whether the jerk limit binds; otherwise clearances alone rise no faster than it allows.
  /// Whether clearances brake early enough that torque keeps its rate. Not while a trajectory leads past what is near, since
  /// that would hold it back.
  bool early = false;
  /// Decision about the clearances before (nv) [/s^2]: they ask for no more; null: none.
  const Eigen::VectorXd* decided = nullptr;
  /// Whether feedback is an impedance: what pushes the arm may make it faster than every overrun, and clearances stop it all the
  /// same.
  bool yields = false;
};

/// Clearances at a second state, which bound the same acceleration: those of the arm itself if the program is solved for its
/// reference.
struct SecondState {
  const Clearances* clearances = nullptr;  ///< Clearances there; null: none.
  const Eigen::VectorXd* velocity = nullptr;
};

/// Limit of Cartesian speed [m/s] now and after the period, at a state of the arm; null: none.
struct SpeedLimitNow {
  const KinematicState* state = nullptr;
  const Eigen::VectorXd* acceleration_limits = nullptr;  ///< Limits (nv) [/s²] of the stop along the path.
  double limit = std::numeric_limits<double>::infinity(), next_limit = limit;
};

/// Mass matrix, its Cholesky factor, and bias h [Nm | N] (Coriolis, centrifugal and gravity).
struct BrakingTorque {
  const Eigen::MatrixXd& mass;
  const Eigen::MatrixXd& mass_cholesky;
  const Eigen::VectorXd& bias;
};

/// Violations found before any row is written.
struct Survey {
  double least_clearance = std::numeric_limits<double>::infinity();  ///< Smallest clearance [m].
  int least_coordinate = -1, least_nearest = -1;
  bool closes = false;  ///< Whether a clearance below zero still decreases.

  bool lost() const noexcept { return least_clearance < 0.0; }
};

/// All that a constraint may read of one solve.
struct Moment {
  double period;         ///< Time for which the acceleration is held [s].
  double speed_share;    ///< Share of the velocity limits that torques leave which change rarely, in (0, 1].
  double inside;         ///< Time at the velocity limits by whose way position limits move inwards then, beside the margin [s].
  double torque_period;  ///< Time whose change of torque may be made at once, at most as long [s].
  const Eigen::VectorXd& position;
  const Eigen::VectorXd& velocity;
  const Eigen::VectorXd* wanted;  ///< Wanted acceleration [/s²]; null: unusable.
  const BrakingTorque* dynamics;  ///< Mass matrix and bias; null: unusable.
  double jerk_share;              ///< Share of the jerk limits with which torque keeps its rate [-].
  bool keeps_torque_rate;         ///< Whether some torque has a rate limit and a last value.
  const LastCommand& last;
  const Clearances* clearances;  ///< Clearances at the state; null: none.
  const SecondState& second;
  const SpeedLimitNow& speed;
  const Survey& found;  ///< What is violated already; complete when `append` is called.
};

/// A bound on the acceleration of the next period. One subclass, one file; see docs/how-to/add-a-constraint.md.
///
/// All methods are noexcept and allocate nothing. In each solve the program calls `usable`, `survey` and `append` of all
/// constraints in the order of its list. If not all can be kept, it calls `widen` to `defer_recovery`; at the end `report`.
class Constraint {
 public:
  virtual ~Constraint() = default;

  /// How its rows give way: never, clearance or comfort.
  virtual Priority priority() const noexcept = 0;
  /// Most rows that it ever appends.
  virtual int max_rows() const noexcept = 0;
  /// Appends its rows, whose block is empty, and narrows the bounds of all joints.
  virtual void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept = 0;

  /// Whether its input is finite and of the right size. Otherwise the arm is stopped within all other constraints.
  virtual bool usable(const Moment&) const noexcept { return true; }
  /// Reports violations of the present state.
  virtual void survey(const Moment&, Survey&) const noexcept {}
  /// Whether the damped stop keeps it too, which knows the state alone.
  virtual bool bounds_stop() const noexcept { return false; }

  /// Writes `bounds.wide`: bounds of the acceleration after jerk or comfort gave way.
  virtual void widen(Priority /*given_up*/, const Moment&, Bounds&) const noexcept {}
  /// Weakens its rows to the least that keeps the current stop feasible, before jerk gives way. False: nothing to weaken.
  virtual bool relax_to_braking(const Moment&, RowBlock&) noexcept { return false; }
  /// Undoes relax_to_braking.
  virtual void restore(RowBlock&) noexcept {}
  /// After relax_to_braking: appends its recovery as rows, which use whatever jerk is left. False: none.
  virtual bool add_recovery(RowBlock&) noexcept { return false; }
  /// While a clearance is lost: defers recovery that opposes the way out.
  virtual void defer_recovery(const Moment&, RowBlock&) noexcept {}

  /// Removes rounding from the command. False: the command is outside its limits, and the solution is rejected.
  virtual bool admit(MotionSolution&) const noexcept { return true; }
  /// Writes its effect into the solution, and raises the status if it gave way. wanted: acceleration that was solved for.
  virtual void report(const Moment& now, const Bounds& bounds, const RowBlock& rows, const Eigen::VectorXd& wanted,
                      MotionSolution& solution) const noexcept;
};

}  // namespace sidestep
