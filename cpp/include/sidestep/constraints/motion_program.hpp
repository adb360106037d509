#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "sidestep/constraints/constraint.hpp"
#include "sidestep/constraints/damped_stop.hpp"
#include "sidestep/constraints/hard_program.hpp"
#include "sidestep/constraints/safety_settings.hpp"
#include "sidestep/constraints/shortfall_program.hpp"
#include "sidestep/constraints/slack_program.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

struct MotionProgramSettings {
  /// Control period [s]; the bounds hold the limits at samples this far apart.
  double period = 0.001;
  /// The arm is moved by torque. Otherwise position, velocity and acceleration limits are what its drives can do and never give way
  /// to clearances, no effort is limited, and mass matrix and bias are not read.
  bool by_torque = true;
  /// Q of the cost (q̈ - a)'Q(q̈ - a)/2, diagonal, one entry for all joints or one each [1 per (rad/s^2)^2].
  Eigen::VectorXd tracking_weight = Eigen::VectorXd::Constant(1, 1.0);
  /// R of the cost t'Rt/2 on t = torque/effort limit, diagonal, one entry or one each [-]. The thesis takes Q = 30 and
  /// R = 1 per (Nm)^2: holding 50 Nm of gravity at an inertia of 1 kg m^2 then costs M R torque/Q = 1.7 rad/s^2 of
  /// tracking, and the arm sags. The default leaves 1e-8 rad/s^2. With it R only makes the cost prefer, between two
  /// accelerations of equal error, the one of smaller torque. Without torque it counts as 0.
  Eigen::VectorXd torque_weight = Eigen::VectorXd::Constant(1, 1e-6);
  /// Price of leaving the acceleration bounds when they cannot be kept: that many times the steepest tracking cost [-].
  double slack_weight = 1e3;
  /// Factor up to which velocity limits give way to clearances and torque limits, in [1, inf) [-].
  double velocity_overrun = 1.2;
  /// Factor up to which acceleration limits give way, in [1, inf) [-]. Where effort has a rate, both only as far as they can be
  /// taken back in time.
  double acceleration_overrun = 10.0;
  /// Velocity and acceleration limits do not give way to clearances. Always so without torque.
  bool hard_bounds = false;
  /// What is kept of the clearances, where they are given.
  SafetySettings safety = {};
  /// Whether speed is limited where `MotionRequest::speed` is given.
  bool limits_speed = false;
  /// Position limits are moved inwards by this much [rad | m].
  double position_margin = 0.0;
  /// Time constant of the damped stop q̈ = -v/stop_time [s].
  double stop_time = 0.1;
  /// Damping of the stop when the mass matrix is unusable, as a fraction of effort limit / velocity limit [-].
  double stop_damping = 0.25;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate(const Robot& robot) const;
};

/// Periods of a loop that is not called as often as it was told.
struct MotionPeriods {
  double coming = 0.0;  ///< Until the next solve [s]; 0: the period of the settings.
  double torque = 0.0;  ///< Time whose change of torque may be made at once [s]; 0: the coming period.
  double speed = 1.0;   ///< Share of the velocity limits for joints where some torque has a rate, in (0, 1].
  double inside = 0.0;  ///< Time at the velocity limit by whose way their position limits move inwards, beside the margin [s].
};

/// Input of one solve.
struct MotionRequest {
  Eigen::Ref<const Eigen::VectorXd> q;             ///< Position (nv) [rad | m].
  Eigen::Ref<const Eigen::VectorXd> v;             ///< Velocity (nv) [/s].
  Eigen::Ref<const Eigen::VectorXd> acceleration;  ///< Wanted acceleration (nv) [/s²].
  /// M (nv, nv, symmetric) and bias h (nv) [Nm | N]; not read without torque.
  Eigen::Ref<const Eigen::MatrixXd> mass_matrix = Eigen::MatrixXd();
  Eigen::Ref<const Eigen::VectorXd> bias = Eigen::VectorXd();
  /// Clearances at (q, v), for example those of a GeometricSystem::Workspace; null: none.
  const Clearances* clearances = nullptr;
  SecondState second = {};
  LastCommand last = {};
  SpeedLimitNow speed = {};
  MotionPeriods periods = {};
};

/// Acceleration, and the torque for it, nearest to a wanted one within a list of constraints (thesis T6.3, corrected):
///
///   minimise    1/2 (q̈ - a)'Q(q̈ - a) + 1/2 t'Rt,     t = torque / effort limit
///   subject to  M q̈ + h = torque                      (h: Coriolis, centrifugal and gravity forces)
///               the rows of each Constraint           (see constraint.hpp)
///
/// The torque is eliminated by the equation of motion. Constraints give way in the order of Priority (priority.hpp). The first
/// program has only hard constraints. If it is infeasible, the programs below follow, until one is feasible:
///   1. the same with rows weakened to the least that keeps the current stop feasible;
///   2. the same without jerk limits, for the acceleration nearest to what they allow;
///   3. with slacks of comfort (SlackProgram);
///   4. with the least shortfalls of clearances (ShortfallProgram), also if a lost clearance is in the way.
/// With torque rate limits, the jerk limits are reduced by a share with which torques keep their rate for any motion. This share
/// gives way first; the jerk limits themselves only to bounds that they do not reach, or if a clearance is lost.
///
/// Damped stop. If only the wanted acceleration is unusable, the program is solved with a = -v/stop_time; if the input of a
/// constraint is unusable, the same without that constraint. Otherwise DampedStop. An unusable h is replaced by the last usable
/// one (zero before the first), an unusable v by zero. Every fallback is counted.
///
/// `solve` allocates nothing and never throws. One object per thread.
class MotionProgram {
 public:
  using Constraints = std::vector<std::unique_ptr<Constraint>>;

  /// `own`: further constraints, behind those of joints, torque, clearances and speed. Throws std::invalid_argument if the
  /// settings are not valid, or the priority of a constraint that appends rows is none of never, clearance and comfort.
  explicit MotionProgram(const Robot& robot, MotionProgramSettings settings = {}, Constraints own = {});
  MotionProgram(MotionProgram&&) = default;

  /// Writes all of `solution`, which must have been made for the same number of coordinates. A wrong size counts as invalid input.
  [[nodiscard]] ProgramStatus solve(const MotionRequest& request, MotionSolution& solution) noexcept;

  const MotionProgramSettings& settings() const noexcept { return settings_; }
  int num_coordinates() const noexcept { return nv_; }
  /// The first program of the last solve that had usable input: rows of torques, then those of each constraint, without bounds where
  /// they are not in use.
  const QuadraticProgramData& program() const noexcept { return hard_.data(); }
  /// The share of the jerk limits by which the torque keeps its rate with the last mass matrix, see torque_rate_constraint.hpp.
  double jerk_share(const MotionPeriods& periods = {}) const noexcept;
  /// Number of solves, since construction, that ended with this status.
  std::int64_t count(ProgramStatus status) const noexcept { return counts_[static_cast<std::size_t>(status)]; }

 private:
  /// Usable parts of a request.
  struct Known {
    bool q, v, acceleration, mass, bias, constraints;
    bool state() const noexcept { return q && v; }
    bool all() const noexcept { return q && v && mass && bias; }
  };
  /// Result of a search in the hard program.
  struct Search {
    bool solved = false;
    bool kept_jerk = true;
    bool recovers = false;  ///< Whether recovery was appended, which is still to be solved for.
  };

  Known take(const MotionRequest& request) noexcept;
  bool take_mass(const MotionRequest& request) noexcept;
  /// Writes the bounds and rows of all constraints, or of those that the damped stop keeps.
  void write(const Moment& now, const Known& known, MotionSolution& solution) noexcept;
  bool solve_hard(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, bool smooth, MotionSolution& solution) noexcept;
  Search search(const Moment& now, MotionSolution& solution) noexcept;
  bool search_without_jerk(const Moment& now, MotionSolution& solution) noexcept;
  ProgramStatus solve_constrained(const Moment& now, bool usable, MotionSolution& solution) noexcept;
  /// Solves the programs after the first. smooth: within the jerk limits, which leave a solution.
  ProgramStatus solve_relaxed(const Moment& now, bool smooth, MotionSolution& solution) noexcept;
  bool solve_slack(bool rounded, MotionSolution& solution) noexcept;
  /// Status of a relaxed solution, by the bounds and rows that it violates; removes rounding.
  ProgramStatus judge_relaxed(bool box_reached, MotionSolution& solution) const noexcept;
  /// Writes the torque of the solution's acceleration; false if it is beyond its limits.
  bool accept(MotionSolution& solution) const noexcept;
  void stop(const Moment& now, bool mass_known, MotionSolution& solution) const noexcept;
  TrackingCost cost() const noexcept { return {mass_, bias_, wanted_, tracking_weight_, torque_cost_}; }

  int nv_;
  MotionProgramSettings settings_;
  JointLimits limits_;
  Eigen::VectorXd tracking_weight_, torque_cost_;  // Q; R / effort limit^2.
  bool effort_has_rate_;
  Constraints constraints_;
  Bounds bounds_;
  std::vector<RowBlock> blocks_;  // Rows of each constraint.
  HardProgram hard_;
  SlackProgram slack_;
  ShortfallProgram shortfall_;
  ShortRows short_rows_;
  Eigen::MatrixXd mass_, mass_cholesky_;
  Eigen::VectorXd position_, velocity_, wanted_, bias_;  // Usable copies of the input.
  std::int64_t counts_[7] = {};
};

}  // namespace sidestep
