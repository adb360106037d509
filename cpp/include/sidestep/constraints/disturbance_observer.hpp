#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// What a model of an arm lacks, from what its torques brought about.
///
/// The arm moves by (M + J) v̇ + h = τ + d, with M and h of the model. The observer tells
///   - the disturbance d: friction, payload, wrong gravity. With the acceleration a that was predicted with the d known so
///     far, d changes by (M + J) (v̇ − a) T/T_o in every period T: it follows with the time constant T_o;
///   - the inertias J of rotors (diagonal), which gears make larger than those of light links. Of every joint j alone it fits
///         τ − h − z = J v̇ + p z + f sign(v) + b v + c,     z = (M v̇)_j,
///     by least squares over the last seconds of motion, all terms filtered: p is for a payload, which makes what the model has
///     larger; f and b for dry and viscous friction, c for what is constant. Noise of velocities is in both sides, so the sums
///     are taken with the accelerations that were predicted (instrumental variables). What was not excited counts as zero, and
///     J counts only where the fit explains most of what is missing.
/// Both are bounded: |d| by a share of the effort limits, J by a tenth of what the effort limit can accelerate at the
/// acceleration limit. No member but the constructor allocates.
class DisturbanceObserver {
 public:
  /// period, time: T, T_o [s], positive; share of the effort limits [-].
  DisturbanceObserver(const JointLimits& limits, double period, double time, double share);

  /// One period: velocity (nv) [/s] at its begin and end, the torque (nv) [Nm | N] that was sent, the acceleration (nv) that
  /// was predicted for it, the model's mass matrix (nv × nv) and bias (nv) there. What is not finite changes nothing, nor does a
  /// velocity that leaps once, as by an impact: by more than a tenth of its limit beyond what was predicted.
  void update(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::VectorXd& torque,
              const Eigen::VectorXd& predicted, const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& bias) noexcept;

  /// The model's bias has changed by `change` (nv), as by a payload that it is told of now: what d had of that, it has no more.
  /// What was seen of rotors was seen with the other model, and is forgotten; those that were found stay.
  void change_model(const Eigen::VectorXd& change) noexcept;

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
  void identify(Eigen::Index joint, const Seen& seen, const Terms& told) noexcept;
  void find_rotor(Eigen::Index joint, double mass) noexcept;

  double period_, share_of_period_;
  Eigen::VectorXd most_disturbance_, most_unexpected_, most_rotor_;
  Eigen::VectorXd disturbance_, rotors_, acceleration_;
  std::vector<Joint> joints_;
  bool leaps_ = false;    // Whether the velocity jumped in the last period.
  std::size_t next_ = 0;  // Joint whose inertia is estimated in this period.
};

}  // namespace sidestep
