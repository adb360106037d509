#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

/// What a Controller does where an obstacle blocks a trajectory.
enum class TrajectoryBehaviour {
  keep_path,  ///< stay on the path: slow down and wait in front of the obstacle, go on when the path is free
  steer,      ///< go around, and rejoin
};

/// Joint positions over time: a cubic on every span, of which the velocity at a sample is the slope of the parabola through
/// it and its neighbours (Catmull-Rom for equal spans). Its clock s [s] may run slower than time, at a rate r = ds/dt <= 1:
///
///     dq/dt = q' r,     d²q/dt² = q'' r² + q' dr/dt,        ' = d/ds.
///
/// `rate` says how fast it may run: so that velocities and accelerations stay within limits, up to a rest at the end. With
/// y = r² these are linear, |q''_j y + q'_j y'/2| <= A_j, and one pass from the end backwards gives the largest y from
/// which the clock can still brake before all that follows.
class JointTrajectory {
 public:
  /// q (nv × K) [rad | m] at times (K) [s], increasing, the first not below zero; of `robot`, within its position limits.
  /// velocity, acceleration (nv): limits. Throws std::invalid_argument that names the sample, the joint, its value and what
  /// is allowed.
  JointTrajectory(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::VectorXd& times, const Eigen::VectorXd& velocity,
                  const Eigen::VectorXd& acceleration);

  /// The arm's state when the clock starts. Joints without limits take the nearest full turn. If the first sample is after zero,
  /// the trajectory starts from this state. No allocation.
  void begin_at(ConstVectorRef q, ConstVectorRef v) noexcept;

  double duration() const noexcept { return times_[times_.size() - 1]; }
  /// At s, clamped to the trajectory; at rest at the end and after. No allocation.
  void sample(double s, Eigen::VectorXd& q, Eigen::VectorXd& velocity, Eigen::VectorXd& acceleration) const noexcept;
  /// The largest rate of the clock at s, 0 at the end.
  double rate(double s) const noexcept;

 private:
  void limit_rates(const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration);

  bool led_ = false;  // to its first sample: the first column is where it begins
  std::vector<bool> turns_;
  Eigen::VectorXd times_;
  Eigen::MatrixXd q_, v_;  // (nv × K)
  double first_ = 0.0, station_ = 0.0;
  std::vector<double> squares_;  // y at first_ + k station_
};

}  // namespace sidestep
