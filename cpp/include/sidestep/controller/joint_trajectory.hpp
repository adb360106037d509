#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// What a Controller does where an obstacle blocks a trajectory.
enum class TrajectoryBehaviour {
  keep_path,  ///< stay on the path: slow down and wait in front of the obstacle, go on when the path is free
  steer,      ///< go around, and rejoin
};

/// The samples of a trajectory: q (nv × K) [rad | m] at times (K) [s].
struct TrajectorySamples {
  Eigen::MatrixXd q;
  Eigen::VectorXd times;
};

/// Joint positions over time: a cubic on every span. The velocity at a sample is the slope of the parabola through it and its
/// neighbours, lowered to twice the smaller slope of both spans (M. Steffen, A simple method for monotonic interpolation in one
/// dimension, Astronomy and Astrophysics 239, 1990): monotone samples stay monotone, dwells still. Where a joint turns it goes
/// at most 0.5 mrad (0.1 mm if it slides) beyond the sample, and everywhere at most 0.01 rad (2 mm) from the straight lines
/// between the samples. Stamps that limits do not allow because samples bunch up, as recorders write them, move between their
/// neighbours, by 0.2 s at most; a sample that is there twice within 5 ms counts once. Samples of joints without limits are a
/// turn more or less from each other: the short way counts.
///
/// Its clock s [s] may run slower than time, at a rate r = ds/dt <= 1:
///
///     dq/dt = q' r,     d²q/dt² = q'' r² + q' dr/dt,        ' = d/ds.
///
/// `rate` says how fast it may run: so that velocities and accelerations stay within limits, up to a rest at the end. With
/// y = r² these are linear, |q''_j y + q'_j y'/2| <= A_j, and one pass from the end backwards gives the largest y from
/// which the clock can still brake before all that follows.
class JointTrajectory {
 public:
  /// q (nv × K) [rad | m] at times (K) [s], increasing but for samples that are there twice, the first from 0 to 3600 s; of `robot`, within its position limits.
  /// velocity, acceleration (nv): limits. Throws std::invalid_argument that names the sample, the joint, its value and what
  /// is allowed.
  JointTrajectory(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::VectorXd& times, const Eigen::VectorXd& velocity,
                  const Eigen::VectorXd& acceleration);

  /// The arm's state when the clock starts. Joints without limits take the nearest full turn. If the first sample is after zero,
  /// the trajectory starts from this state, and stays between it and the first sample but for 0.01 rad (2 mm). No allocation.
  void begin_at(ConstVectorRef q, ConstVectorRef v) noexcept;

  double duration() const noexcept { return times_[times_.size() - 1]; }
  /// At s, clamped to the trajectory; at rest at the end and after. No allocation.
  void sample(double s, Eigen::VectorXd& q, Eigen::VectorXd& velocity, Eigen::VectorXd& acceleration) const noexcept;
  /// Distance of q from the straight lines between the samples, as they were given, in the farthest joint [rad | m]: the nearest
  /// of the lines within 0.05 s of s. No allocation.
  /// Joint: the farthest.
  struct Deviation {
    double value = 0.0;  ///< [rad | m]
    Eigen::Index joint = 0;
  };
  Deviation deviation(double s, const Eigen::VectorXd& q) const noexcept;
  /// Time on the stamps as they were given, where the clock is at s.
  double stamp(double s) const noexcept;
  /// Time of the first sample.
  double first() const noexcept { return first_; }
  /// Whether the way to the first sample ends at rest, so that the clock has to start there again.
  bool stands_at_first() const noexcept { return stands_; }
  /// The largest rate of the clock at s, 0 at the end.
  double rate(double s) const noexcept;

 private:
  void set_slopes(Eigen::Index begin);
  void limit_rates(Eigen::Index begin, const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration);
  void cubic(Eigen::Index k, double u, Eigen::VectorXd& q, Eigen::VectorXd& v, Eigen::VectorXd& a) const noexcept;
  Eigen::Index span_at(double s) const noexcept;

  bool led_ = false;  // The first column is where it begins, before the first sample.
  bool stands_ = false;
  std::vector<bool> turns_;
  Eigen::VectorXd times_, stamps_;  // Times of the samples on the clock, and as they were given.
  Eigen::MatrixXd q_, v_;           // (nv × K)
  Eigen::VectorXd corner_;          // [rad | m] off the straight lines at most
  Eigen::VectorXd lead_end_;        // velocity where the way to the first sample ends
  double first_ = 0.0;
  std::vector<double> stations_, squares_;  // y at each station [s]
};

}  // namespace sidestep
