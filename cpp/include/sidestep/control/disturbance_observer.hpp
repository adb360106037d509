#pragma once

#include <Eigen/Core>

#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

/// What a model of an arm lacks, from what its torques brought about.
///
/// The arm moves by (M + J) v̇ + h = τ + d, with M and h of the model. The observer tells
///   - the disturbance d: friction, payload, wrong gravity. With the acceleration a that was predicted with the d known so
///     far, d changes by (M + J) (v̇ − a) T/T_o in every period T: it follows with the time constant T_o;
///   - the inertias J of rotors (diagonal), which gears make larger than those of light links: the slope of what is missing,
///     τ − h − M v̇, over v̇, both between 1.6 and 16 Hz, by least squares over the last seconds. Where a joint turns back,
///     dry friction would count as inertia: those samples are left out; so is what goes with the forces of other joints'
///     accelerations, as a payload's does.
/// Both are bounded: |d| by a share of the effort limits, J by what the effort limit can accelerate at the acceleration limit.
/// No member allocates.
class DisturbanceObserver {
 public:
  /// period, time: T, T_o [s], positive; share of the effort limits [-].
  DisturbanceObserver(const JointLimits& limits, double period, double time, double share);

  /// One period: velocity (nv) [/s] at its begin and end, the torque (nv) [Nm | N] that was sent, the acceleration (nv) that
  /// was predicted for it, the model's mass matrix (nv × nv) and bias (nv) there. What is not finite changes nothing.
  void update(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::VectorXd& torque,
              const Eigen::VectorXd& predicted, const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& bias) noexcept;

  const Eigen::VectorXd& disturbance() const noexcept { return disturbance_; }  ///< d (nv) [Nm | N]
  const Eigen::VectorXd& rotors() const noexcept { return rotors_; }            ///< J (nv) [kg m² | kg]

 private:
  struct Filters {
    Eigen::VectorXd quick, slow;  // two low-pass filters, whose difference is the band
  };
  void identify(Eigen::Index joint, double v, double acceleration, double coupled, double missing) noexcept;

  double period_, share_of_period_;
  Eigen::VectorXd most_disturbance_, most_rotor_;
  Eigen::VectorXd disturbance_, rotors_, acceleration_;
  // Of every joint: its acceleration x, the model's force z of the other joints' accelerations, the missing force y; sums of
  // their products; how long it moves one way.
  Filters acceleration_band_, coupled_band_, missing_band_;
  Eigen::VectorXd xx_, xz_, zz_, xy_, zy_, yy_, one_way_, last_v_;
};

}  // namespace sidestep
