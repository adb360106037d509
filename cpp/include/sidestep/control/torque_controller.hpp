#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sidestep/control/acceleration_bounds.hpp"
#include "sidestep/control/quadratic_program.hpp"
#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

/// How a control step ended, from best to worst. The torque is safe to send after every one of them.
enum class TorqueStatus {
  ok,                      ///< the wanted acceleration is tracked, no limit in the way
  limited,                 ///< optimal within the limits, and at least one of them is in the way
  relaxed,                 ///< the torque limits do not allow the acceleration bounds of some joint (see slack)
  fallback_invalid_input,  ///< the input is unusable (see fault): damped stop
  fallback_solver,         ///< the quadratic program could not be solved: damped stop
};

/// Which input is unusable.
enum class TorqueFault { none, position, velocity, acceleration, mass_matrix, bias };

/// Short names, for example "limited", "mass_matrix".
const char* name(TorqueStatus status) noexcept;
const char* name(TorqueFault fault) noexcept;

/// What one control step gives. Made once, written by every solve.
struct TorqueSolution {
  explicit TorqueSolution(int num_coordinates);

  TorqueStatus status = TorqueStatus::ok;
  TorqueFault fault = TorqueFault::none;
  Eigen::VectorXd torque;                          ///< [Nm | N], within the effort limits, always finite
  Eigen::VectorXd acceleration;                    ///< M^-1 (torque - bias) [/s^2]; NaN where M or bias is unusable
  Eigen::VectorXd slack;                           ///< acceleration beyond its bounds [/s^2], signed; 0 unless relaxed
  Eigen::VectorXd lower, upper;                    ///< the acceleration bounds used [/s^2]; NaN if q or v is unusable
  std::vector<Limit> active;                       ///< the limits in the way of each joint
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
///               |torque| <= effort limit               (hard)
///               lower(q, v) <= q̈ <= upper(q, v)        (see acceleration_bounds.hpp; soft)
///
/// The torque is eliminated by the first constraint. The bounds are kept exactly whenever the torque limits allow it;
/// else a second program adds slack s >= 0 to them at the cost p's + s's/2, with p large enough to be exact in practice.
///
/// The damped stop. If only the wanted acceleration is unusable, the same program is solved with a = -v/stop_time.
/// Otherwise torque = M (-v/stop_time) + h clipped to the effort limits; if M is unusable, h - D v clipped; an unusable
/// h is replaced by the last usable one (zero before the first), an unusable v by zero. Every fallback is counted.
///
/// `solve` allocates nothing and never throws. One object per thread.
class TorqueController {
 public:
  /// Throws std::invalid_argument if the settings are not valid.
  explicit TorqueController(const Robot& robot, TorqueControllerSettings settings = {});

  /// q [rad | m], v [/s], wanted acceleration [/s^2], mass matrix M (nv, nv, symmetric), bias h [Nm | N]. A wrong size
  /// counts as invalid input. Writes all of `solution`, which must have been made for the same number of coordinates.
  [[nodiscard]] TorqueStatus solve(const Eigen::Ref<const Eigen::VectorXd>& q,
                                   const Eigen::Ref<const Eigen::VectorXd>& v,
                                   const Eigen::Ref<const Eigen::VectorXd>& acceleration,
                                   const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix,
                                   const Eigen::Ref<const Eigen::VectorXd>& bias, TorqueSolution& solution) noexcept;

  const TorqueControllerSettings& settings() const noexcept { return settings_; }
  int num_coordinates() const noexcept { return nv_; }
  /// Number of solves, since construction, that ended with this status.
  std::int64_t count(TorqueStatus status) const noexcept { return counts_[static_cast<std::size_t>(status)]; }

 private:
  bool solve_within_bounds(TorqueSolution& solution) noexcept;
  bool solve_relaxed(TorqueSolution& solution) noexcept;
  bool accept(TorqueSolution& solution) noexcept;
  void stop(bool mass_known, TorqueSolution& solution) noexcept;
  bool factorise_mass() noexcept;

  int nv_;
  TorqueControllerSettings settings_;
  JointLimits limits_;
  Eigen::VectorXd tracking_weight_, torque_cost_;  // Q; R / effort limit^2
  AccelerationBounds bounds_;
  QuadraticProgramData hard_data_, relaxed_data_;
  QuadraticProgram hard_, relaxed_;
  Eigen::MatrixXd mass_, mass_cholesky_;
  Eigen::VectorXd velocity_, wanted_, bias_;       // usable copies of the input
  std::int64_t counts_[5] = {};
};

}  // namespace sidestep
