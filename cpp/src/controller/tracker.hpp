#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "arm_dynamics.hpp"
#include "attractor_stage.hpp"
#include "joint_kinds.hpp"
#include "joint_program.hpp"
#include "measured_state.hpp"
#include "reference.hpp"
#include "sidestep/controller/settings.hpp"
#include "tick.hpp"

namespace sidestep {

/// Whether position or velocity is commanded: then the arm's drives track the reference.
inline bool drives_track(const ControllerSettings& settings) noexcept {
  return settings.output == ControllerSettings::Output::position || settings.output == ControllerSettings::Output::velocity;
}

/// Stage `tracker`: the arm follows the reference by feedback at the measured state,
///   q̈ = q̈_r + ω² (q_r − t q̇_r − q) + 2 ζ ω (q̇_r − q̇),   t = Tick::lead, 0 in a loop of the period that it was told,
/// or as an impedance, within every limit.
class Tracker {
 public:
  /// Throws std::invalid_argument where the settings ask for an impedance that the arm cannot have.
  Tracker(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings, bool torque);

  /// Writes the acceleration by which the reference gives way to an arm that cannot follow it (nv).
  void write_coupling(const Reference& reference, const Eigen::VectorXd& arm_q, const Tick& tick,
                      Eigen::VectorXd& coupling) const noexcept;

  /// Moves the reference to where feedback pushes the arm at q (nv) by no more than `torque` (nv) [Nm | N]; M: mass matrix. False
  /// where it is there already.
  bool yield(const Eigen::VectorXd& arm_q, const Eigen::MatrixXd& mass, const Eigen::VectorXd& torque, const Tick& tick,
             Reference& reference) const noexcept;

  /// The arm at the moment of a step, where it is not exactly where the reference is.
  struct Arm {
    const Eigen::VectorXd& q;
    const Eigen::VectorXd& v;
    const Clearances& clearances;
    const ArmDynamics& dynamics;  // there
    const LastOutput& last;
    const SpeedLimitNow& speed;
  };
  /// Writes the solution that tracks the reference; `tracking_error` [rad | m]: the largest of a joint. `decided`: what the program
  /// of the reference ended with. Returns that, or what is worse.
  ProgramStatus track(const Reference& reference, const Arm& arm, double tracking_error, ProgramStatus decided,
                      const Tick& tick) noexcept;
  /// The arm is where the reference is: it is commanded the same.
  void follow(const MotionSolution& reference) noexcept {
    solution_.torque = reference.torque;
    solution_.acceleration = reference.acceleration;
  }
  /// The last guard of the torque's rate, for what comes from elsewhere than the program: true where it changes the torque.
  bool keep_torque_rate(const LastOutput& last, const ArmDynamics& dynamics, const Tick& tick,
                        Eigen::VectorXd& torque) noexcept;
  /// Writes the velocity that leads an arm back to its reference, for an output of velocities; `known`: where the arm is.
  void write_velocity(const Reference& reference, const Eigen::VectorXd& arm_q, bool known, const Tick& tick,
                      Eigen::VectorXd& velocity) noexcept;
  void begin_anew() noexcept { drift_.setZero(); }
  void go_on_from(const Tracker& before) noexcept;

  bool drives_track() const noexcept { return drives_track_; }  ///< position or velocity is commanded
  const MotionSolution& solution() const noexcept { return solution_; }
  MotionSolution& solution() noexcept { return solution_; }

 private:
  static constexpr int most_of_impedance = 32;  // joints
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_of_impedance, most_of_impedance>;

  bool is_impedance() const noexcept { return torque_ && settings_.tracking.stiffness > 0.0; }
  /// Largest ω of the feedback [1/s]: a slow loop holds its torques for long.
  double largest_frequency(const Tick& tick) const noexcept;
  /// ω of the feedback [1/s].
  double feedback_frequency(const Reference& reference, const Arm& arm, const Tick& tick) const noexcept;
  /// Writes the acceleration that an impedance around the reference asks for.
  void write_impedance(const Reference& reference, const Arm& arm, const Tick& tick) noexcept;

  const JointLimits& limits_;
  const JointKinds& joints_;
  const ControllerSettings& settings_;
  const bool torque_, drives_track_;
  JointProgram program_;
  MotionSolution solution_;
  Eigen::VectorXd feedback_;
  Eigen::VectorXd drift_;  // Commanded velocity less that of the reference, with velocity output [rad/s | m/s].
  Eigen::MatrixXd mass_cholesky_;
  Eigen::SelfAdjointEigenSolver<Small> modes_;
};

}  // namespace sidestep
