#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Observer of model errors: it compares the motion with the one that the model predicts for the torques.
///
/// The arm moves by (M + J) v̇ + h = τ + d, with M and h of the model. The observer estimates
///   - the disturbance d: friction, payload, wrong gravity. With the acceleration a predicted with the present d, d changes by
///     (M + J) (v̇ − a) T/T_o in every step, T after the last: it follows with the time constant T_o;
///   - the inertias J of rotors (diagonal), which gears make larger than those of light links. For each joint j it fits
///         τ − h − z = J v̇ + p z + f sign(v) + b v + c,     z = (M v̇)_j,
///     by least squares over the last seconds of motion, with all terms filtered. p stands for a payload, which scales the
///     model's inertia, f and b for dry and viscous friction, c for constant errors. Velocity noise is on both sides, so the
///     sums use the predicted accelerations (instrumental variables). Terms that the motion does not excite count as zero,
///     and J counts only if the fit explains most of the missing torque.
/// Both are bounded: |d| by a share of the effort limits, J by a tenth of the effort limit over the acceleration limit. Only the
/// constructor allocates.
class DisturbanceObserver {
 public:
  /// time: T_o [s], positive; share: bound of |d| over the effort limits [-].
  DisturbanceObserver(const JointLimits& limits, double time, double share);

  /// The motion from one step to the next.
  struct Motion {
    const Eigen::VectorXd& before;     ///< velocity (nv) [/s] at its begin
    const Eigen::VectorXd& after;      ///< and at its end
    const Eigen::VectorXd& torque;     ///< sent (nv) [Nm | N]
    const Eigen::VectorXd& predicted;  ///< acceleration (nv)
    double duration;                   ///< T [s], positive
  };
  /// Takes a motion, with the model's mass matrix (nv × nv) and bias (nv) there. Values that are not finite change nothing. Nor does a
  /// single jump of the velocity, as by an impact, by more than a tenth of its limit beyond the prediction.
  void update(const Motion& motion, const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& bias) noexcept;

  /// Removes `change` (nv) of the model's bias from d, for example when the model is told of a payload. Data about rotors came from
  /// the previous model and are forgotten; estimates stay.
  void change_model(const Eigen::VectorXd& change) noexcept;

  /// Goes on from this disturbance (nv), within its bound: another one was no error of the model.
  void set_disturbance(const Eigen::VectorXd& disturbance) noexcept;

  const Eigen::VectorXd& disturbance() const noexcept { return disturbance_; }  ///< d (nv) [Nm | N]
  const Eigen::VectorXd& rotors() const noexcept { return rotors_; }            ///< J (nv) [kg m² | kg]

 private:
  static constexpr int num_terms = 5;  // Number of terms: v̇, z, sign(v), v, 1.
  using Terms = Eigen::Matrix<double, num_terms, 1>;
  using Seen = Eigen::Matrix<double, num_terms + 1, 1>;  // The terms, and the missing torque.
  struct Joint {
    Seen seen = Seen::Zero();
    Terms told = Terms::Zero();  // Terms with the predicted acceleration.
    Eigen::Matrix<double, num_terms, num_terms + 1> instrumented = Eigen::Matrix<double, num_terms, num_terms + 1>::Zero();
    Eigen::Matrix<double, num_terms + 1, num_terms + 1> products = Eigen::Matrix<double, num_terms + 1, num_terms + 1>::Zero();
  };
  void identify(Eigen::Index joint, const Seen& seen, const Terms& told, double duration) noexcept;
  void find_rotor(Eigen::Index joint, double mass, double duration) noexcept;

  double time_;
  Eigen::VectorXd most_disturbance_, most_leap_, most_rotor_;
  Eigen::VectorXd disturbance_, rotors_, acceleration_;
  std::vector<Joint> joints_;
  bool leaps_ = false;    // Whether the velocity jumped in the last period.
  std::size_t next_ = 0;  // Joint whose inertia is estimated in this period.
};

}  // namespace sidestep
