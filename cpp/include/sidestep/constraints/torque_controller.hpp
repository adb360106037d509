#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "sidestep/constraints/acceleration_bounds.hpp"
#include "sidestep/math/quadratic_program.hpp"
#include "sidestep/constraints/safety_rows.hpp"
#include "sidestep/constraints/speed_rows.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// How a control step ended, from best to worst. The torque is safe to send after every one of them.
enum class TorqueStatus {
  ok,                      ///< the wanted acceleration is tracked, no limit in the way
  limited,                 ///< optimal within the limits, and at least one of them is in the way
  relaxed,                 ///< limits of jerk, joint or Cartesian speed, or acceleration gave way to clearances,
                           ///< position or torque limits
  relaxed_safety,          ///< not all clearances, position limits and overruns can be kept (see safety, slack)
  clearance_lost,          ///< the least clearance is below zero: in contact or inside, whatever the rest
  fallback_invalid_input,  ///< the input is unusable (see fault): damped stop
  fallback_solver,         ///< the quadratic program could not be solved: damped stop
};

/// Which input is unusable.
enum class TorqueFault { none, position, velocity, acceleration, mass_matrix, bias, clearances };

/// Short names, for example "limited", "mass_matrix".
const char* name(TorqueStatus status) noexcept;
const char* name(TorqueFault fault) noexcept;

/// What one control step did about one clearance.
struct SafetyRow {
  int coordinate;     ///< which clearance
  int nearest;        ///< its nearest obstacle point
  bool along_path;    ///< asks for a stop along the path: −|∇h| v/|v| stands for ∇h below (see safety_rows.hpp)
  double required;    ///< smallest ∇h·q̈ [m/s²] that was asked for
  double slack;       ///< by how much the solution falls short of it [m/s²]; 0 unless relaxed_safety
  double multiplier;  ///< what the row costs the task, >= 0; the largest one dominates
};

/// What one control step gives. Made once, written by every solve.
struct TorqueSolution {
  explicit TorqueSolution(int num_coordinates, int max_safety_rows = SafetySettings().max_rows);

  TorqueStatus status = TorqueStatus::ok;
  TorqueFault fault = TorqueFault::none;
  Eigen::VectorXd torque;         ///< [Nm | N], within the effort limits, always finite
  Eigen::VectorXd acceleration;   ///< M^-1 (torque - bias) [/s^2]; NaN where M or bias is unusable
  Eigen::VectorXd slack;          ///< acceleration beyond its bounds [/s^2], signed; 0 unless relaxed
  Eigen::VectorXd lower, upper;   ///< the acceleration bounds used [/s^2]; NaN if q or v is unusable
  std::vector<Limit> active;      ///< the limits in the way of each joint
  std::vector<SafetyRow> safety;  ///< the first num_safety_rows, most critical first
  int num_safety_rows = 0;
  int dominant = -1;         ///< the entry of `safety` that bends the motion most; -1 if none
  int speed_frame = -1;      ///< the frame whose speed limit bends the motion most; -1: none
  double speed_slack = 0.0;  ///< how far its row is missed [m/s²]; 0 unless limits of speed gave way
  /// The least of all clearances given [m], exact, also without a row; inf: none.
  double least_clearance = std::numeric_limits<double>::infinity();
  int least_coordinate = -1, least_nearest = -1;  ///< which clearance that is, and its nearest point; -1: none
};

/// What the last period's command was, where jerk and torque rate are to keep their limits; null leaves a limit out.
struct LastCommand {
  const Eigen::VectorXd* acceleration = nullptr;  ///< (nv) [/s^2]
  const Eigen::VectorXd* torque = nullptr;        ///< (nv) [Nm | N]
  /// (nv) The bias's gravity now, and its change since then [Nm | N]: effort and its rate keep their limits with and without
  /// it, as drives that hold the arm themselves are told less.
  const Eigen::VectorXd* gravity = nullptr;
  const Eigen::VectorXd* gravity_change = nullptr;
  /// Up to which the acceleration may exceed its limits, of feedback against what the model lacks, in [1, inf) [-].
  double acceleration_factor = 1.0;
  bool binds = true;  ///< the jerk limit; else clearances alone rise no faster than it allows
  /// Where torques have a rate, clearances brake early enough to do it smoothly. Not while a trajectory leads past what is near: it
  /// would be held back.
  bool early = false;
  /// (nv) What was decided of the clearances before [/s^2]: they ask for no more.
  const Eigen::VectorXd* decided = nullptr;
};

/// Clearances at another state, which bound the same acceleration: those of the arm itself where its reference is what is
/// solved for.
struct SecondState {
  const Clearances* clearances = nullptr;  ///< null: none
  const Eigen::VectorXd* velocity = nullptr;
};

struct TorqueControllerSettings {
  /// Control period [s]; the bounds hold the limits at samples this far apart.
  double period = 0.001;
  /// Q of the cost (q̈ - a)'Q(q̈ - a)/2, diagonal, one entry for all joints or one each [1 per (rad/s^2)^2].
  Eigen::VectorXd tracking_weight = Eigen::VectorXd::Constant(1, 1.0);
  /// R of the cost t'Rt/2 on t = torque/effort limit, diagonal, one entry or one each [-]. The thesis takes Q = 30 and
  /// R = 1 per (Nm)^2: holding 50 Nm of gravity at an inertia of 1 kg m^2 then costs M R torque/Q = 1.7 rad/s^2 of
  /// tracking, and the arm sags. The default leaves 1e-8 rad/s^2. With it R only makes the cost prefer, between two
  /// accelerations of equal error, the one of smaller torque.
  Eigen::VectorXd torque_weight = Eigen::VectorXd::Constant(1, 1e-6);
  /// Price of leaving the acceleration bounds when they cannot be kept: that many times the steepest tracking cost [-].
  double slack_weight = 1e3;
  /// For clearances and torque limits the velocity limits give way up to this factor, in [1, inf) [-].
  double velocity_overrun = 1.2;
  /// And the acceleration limits up to this one, in [1, inf) [-]. Where effort has a rate, both only as far as they can be taken
  /// back in time.
  double acceleration_overrun = 10.0;
  /// What is kept of the clearances, where they are given.
  SafetySettings safety = {};
  /// How many limits of Cartesian speed `solve` may be given, see SpeedRows::max_size.
  int max_speed_rows = 0;
  /// Velocity and acceleration limits do not give way to clearances. For motion without torque, see AccelerationFilter.
  bool hard_bounds = false;
  /// Position limits are moved inwards by this much [rad | m].
  double position_margin = 0.0;
  /// Time constant of the damped stop q̈ = -v/stop_time [s].
  double stop_time = 0.1;
  /// Damping of the stop when the mass matrix is unusable, as a fraction of effort limit / velocity limit [-].
  double stop_damping = 0.25;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate(const Robot& robot) const;
};

/// Torque that tracks a wanted acceleration within every limit of the arm (thesis T6.3, corrected):
///
///   minimise    1/2 (q̈ - a)'Q(q̈ - a) + 1/2 t'Rt,     t = torque / effort limit
///   subject to  M q̈ + h = torque                      (h: Coriolis, centrifugal and gravity forces)
///               |torque| <= effort limit
///               ∇h_k·q̈ >= required_k                   (clearances, see safety_rows.hpp)
///               n_f·J_f q̈ <= allowed_f                  (Cartesian speed where it is limited, see speed_rows.hpp)
///               lower(q, v) <= q̈ <= upper(q, v)        (see acceleration_bounds.hpp)
///               |q̈ - last q̈| <= jerk limit T,   |torque - last torque| <= effort rate T,   where these are given
///
/// The torque is eliminated by the first constraint. What is sacrificed, in this order: the task, which is the cost;
/// jerk; limits of Cartesian speed, and of velocity and acceleration up to the overruns (unless hard_bounds); clearances; the
/// overruns and position limits; torque limits and the torque's rate never. Where effort has a rate, jerk is lowered by a share with
/// which torques keep it whatever the joints do; that share gives way first, the jerk limits themselves only to bounds that they do
/// not reach, or where a clearance is below zero. A first program has every constraint hard. If it is infeasible, the same is solved
/// without jerk (or with the limits themselves) for the acceleration nearest to what jerk allows. If that is infeasible, a second
/// one adds slack to the bounds, and one slack to all limits of Cartesian speed, within a box of the overruns and of position
/// limits, at the cost p's with a price p far above the task's. If that is infeasible, or a clearance below zero is in the way, a third one finds the shortfalls r of the
/// clearances of which Σ w r² is least, with w = |∇h|²/(|∇h|² + ε²), by which their rows are then lowered: first of
/// those that are not below zero, then of those that are, w times their depth over the largest. What pulls two ways is
/// shared, and an arm that cannot get out comes to rest. Where the torque does not reach the box, it is first widened
/// by the least squares that do. So there always is a solution.
///
/// The damped stop. If only the wanted acceleration is unusable, the same program is solved with a = -v/stop_time; if
/// clearances are unusable, the same without them.
/// Otherwise torque = M a + h with a = -v/stop_time within the bounds, clipped to the effort limits and to what the rate allows; if M
/// is unusable, h - D v clipped; an unusable h is replaced by the last usable one (zero before the first), an unusable v by zero.
/// Every fallback is counted.
///
/// `solve` allocates nothing and never throws. One object per thread.
class TorqueController {
 public:
  /// Throws std::invalid_argument if the settings are not valid.
  explicit TorqueController(const Robot& robot, TorqueControllerSettings settings = {});

  /// q [rad | m], v [/s], wanted acceleration [/s^2], mass matrix M (nv, nv, symmetric), bias h [Nm | N]. A wrong size
  /// counts as invalid input. Writes all of `solution`, which must have been made for the same number of coordinates.
  [[nodiscard]] TorqueStatus solve(ConstVectorRef q, ConstVectorRef v, ConstVectorRef acceleration,
                                   const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix, ConstVectorRef bias,
                                   TorqueSolution& solution) noexcept {
    return solve(q, v, acceleration, mass_matrix, bias, nullptr, solution);
  }

  /// The same with the clearances at (q, v), for example those of a GeometricSystem::Workspace; none if null.
  [[nodiscard]] TorqueStatus solve(ConstVectorRef q, ConstVectorRef v, ConstVectorRef acceleration,
                                   const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix, ConstVectorRef bias,
                                   const Clearances* clearances, TorqueSolution& solution) noexcept {
    return solve(q, v, acceleration, mass_matrix, bias, clearances, {}, {}, solution);
  }

  /// The same near the last command, with the clearances at another state, and limits of Cartesian speed, of which no more
  /// than max_speed_rows are kept; none if null.
  [[nodiscard]] TorqueStatus solve(ConstVectorRef q, ConstVectorRef v, ConstVectorRef acceleration,
                                   const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix, ConstVectorRef bias,
                                   const Clearances* clearances, const SecondState& second, const LastCommand& last,
                                   TorqueSolution& solution, const SpeedRows* speed = nullptr) noexcept;

  const TorqueControllerSettings& settings() const noexcept { return settings_; }
  int num_coordinates() const noexcept { return nv_; }
  /// The first program of the last solve that had usable input: rows of torque limits, of clearances, and of
  /// Cartesian speed, without bounds where they are not in use.
  const QuadraticProgramData& program() const noexcept { return hard_data_; }
  /// The share of the jerk limits by which the torque keeps its rate, whatever the joints do, with the last mass matrix; 1 without
  /// a rate.
  double jerk_share() const noexcept;
  /// Number of solves, since construction, that ended with this status.
  std::int64_t count(TorqueStatus status) const noexcept { return counts_[static_cast<std::size_t>(status)]; }

 private:
  /// Slack below this, relative to 1 /s^2 plus the bound, is rounding and not worth a status.
  static constexpr double slack_tolerance = 1e-9;

  /// The third program for up to `num_rows` clearances.
  struct LeastShortfall {
    LeastShortfall(int nv, int num_rows);
    int num_rows;
    QuadraticProgramData data;  // over (q̈, shortfalls of the rows)
    QuadraticProgram program;
  };

  /// Writes what effort and rate leave of the torque; never empty.
  void set_torque_window(const LastCommand& last) noexcept;
  /// Writes the torque rows: within the effort limits, and near the last torque unless null. Of windows that do not meet, effort
  /// comes before its rate, and both before the same without gravity.
  void write_torque_rows(const LastCommand& last) noexcept;
  void write_cost() noexcept;
  /// Writes the speed rows that the box does not satisfy, from row `first` on; their slack is variable `slack`, unless < 0.
  void write_speed_rows(QuadraticProgramData& data, int first, int slack, const Eigen::VectorXd& lower,
                        const Eigen::VectorXd& upper) const noexcept;
  int num_speed_rows() const noexcept;
  /// The first program; smooth: within the limits of jerk and torque rate.
  bool solve_within_bounds(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, bool smooth,
                           TorqueSolution& solution) noexcept;
  /// The other programs; smooth: within the limits of jerk, which leave a solution.
  TorqueStatus solve_relaxed(bool smooth, TorqueSolution& solution) noexcept;
  void widen_bounds() noexcept;
  void collect_rows() noexcept;
  /// Whether a clearance below zero bends the last solution. Then the third program has its say also where all could be
  /// met: what only the last bit of an acceleration limit can give would come and go from step to step.
  bool presses_for_lost() const noexcept;
  /// Whether a clearance that is not lost has less than it asks for.
  bool others_fall_short(const TorqueSolution& solution) const noexcept;
  /// The second program, with rows lowered by what is allowed; rounded: also where that is next to nothing.
  bool solve_comfort(bool rounded, TorqueSolution& solution) noexcept;
  /// What row n of those used asks for, less what is allowed.
  double lowered(int n, bool rounded) const noexcept;
  /// The third program over x = (q̈, r): the torque rows, normals q̈ + r >= lower, first of the clearances that are not
  /// lost, then of those that are, while the others keep what they have.
  bool solve_least(LeastShortfall& least, bool of_lost, TorqueSolution& solution) noexcept;
  /// Writes what is to be allowed, and an acceleration that falls short by no more.
  bool find_least_shortfalls(TorqueSolution& solution) noexcept;
  /// Joint i has these multipliers at its bounds and its torque.
  void add_active(int i, double at_upper, double at_lower, double at_effort, bool smooth,
                  TorqueSolution& solution) const noexcept;
  void report_clearance(const Clearances* clearances, TorqueSolution& solution) const noexcept;
  bool accept(TorqueSolution& solution) noexcept;
  void report_safety(TorqueSolution& solution) noexcept;
  void report_speed(TorqueSolution& solution) const noexcept;
  /// Names the jerk limits that gave way.
  void report_jerk(TorqueSolution& solution) const noexcept;
  void stop(bool mass_known, TorqueSolution& solution) noexcept;
  bool factorise_mass() noexcept;

  int nv_;
  TorqueControllerSettings settings_;
  JointLimits limits_;
  Eigen::VectorXd tracking_weight_, torque_cost_;  // Q; R / effort limit^2
  AccelerationBounds bounds_;
  SafetyRows rows_;
  const SpeedRows* speed_ = nullptr;  // of the solve under way
  QuadraticProgramData hard_data_;
  QuadraticProgram hard_;
  std::vector<int> rows_used_;  // of rows_, in the programs after the first
  int num_rows_used_ = 0;
  int num_slacks_;                     // of the bounds, and one of speed rows where there may be any
  QuadraticProgramData comfort_data_;  // over (q̈, slacks)
  QuadraticProgram comfort_;
  QuadraticProgramData widening_data_;  // over (q̈, what it is outside the box)
  QuadraticProgram widening_;
  std::vector<LeastShortfall> least_;        // by number of rows, so that the usual few stay cheap
  Eigen::VectorXd allowed_;                  // shortfalls of the rows used
  Eigen::VectorXd row_multipliers_;          // of rows_, >= 0
  Eigen::VectorXd speed_multipliers_;        // of *speed_, >= 0
  Eigen::VectorXd wide_lower_, wide_upper_;  // box of the programs after the first
  // Where torques keep a rate, of the programs after the first too, left only where bounds or torques do not reach it; else infinite.
  Eigen::VectorXd jerk_lower_, jerk_upper_;
  Eigen::MatrixXd mass_, mass_cholesky_;
  Eigen::VectorXd weighted_;                             // a column of the mass matrix, by the cost of torques
  Eigen::VectorXd position_, velocity_, wanted_, bias_;  // usable copies of the input
  double jerk_share_ = 1.0, acceleration_factor_ = 1.0;  // of the solve under way
  bool box_reached_ = true;                              // by the torques, in the programs after the first
  Eigen::VectorXd rate_lower_, rate_upper_;              // of the torque less the bias, by effort and rate
  Eigen::VectorXd torque_lower_, torque_upper_;          // of the torque, by effort and rate: those of the damped stop
  std::int64_t counts_[7] = {};
};

}  // namespace sidestep
