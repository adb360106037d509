#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Trajectory to rest within the limits of acceleration and jerk: the fail-safe trajectory of Pek and Althoff ("Fail-safe motion
/// planning for online verification of autonomous vehicles", 2018), in joint space.
///
/// Joint j has the acceleration a_j and the velocity v_j, and accelerations are held for periods T. Its acceleration changes
/// linearly to −p_j in r periods, stays there for m periods, and changes linearly to zero in r more. The velocity then is exactly
/// zero if
///
///     p_j = (v_j/T + a_j (r − 1)/2) / (r + m).
///
/// All joints share r and m, the shortest with which every joint keeps its limits, so the arm stops nearly along its path. A joint
/// that would leave its position or velocity limits that way gets its own shortest r and m.
class StopTrajectory {
 public:
  explicit StopTrajectory(int num_coordinates);

  /// Plans the stop from q [rad | m], v [/s], a [/s²] (nv), finite; period T [s]. Uses `jerk_share` of the jerk limits. False if no
  /// stop with ramps of at most `most_periods` keeps the acceleration, position and velocity limits. No allocation.
  [[nodiscard]] bool plan(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a, const JointLimits& limits, double period,
                          double jerk_share = 1.0) noexcept;

  double period() const noexcept { return period_; }  ///< T [s] of the last plan
  /// Number of periods left until rest.
  int num_periods() const noexcept { return num_periods_ - passed_; }
  /// Largest distance of each joint from where the stop was planned (nv) [rad | m].
  const Eigen::VectorXd& way() const noexcept { return way_; }
  /// Acceleration between the ramps (nv) [/s²].
  const Eigen::VectorXd& hardest() const noexcept { return hardest_; }
  /// Writes the acceleration (nv) [/s²] of the period that begins after `periods` more.
  void acceleration(int periods, Eigen::VectorXd& a) const noexcept;
  /// Writes the configuration (nv) [rad | m] after `periods` more.
  void position(int periods, Eigen::VectorXd& q) const noexcept;
  /// Advances by one period.
  void advance() noexcept { ++passed_; }

  static constexpr int most_periods = 4000;  // Longest ramp that is tried, in periods.

 private:
  struct Shape {
    int ramp = 1, hold = 0;
    int num_periods() const noexcept { return 2 * ramp + hold; }
  };
  static double plateau(double v, double a, const Shape& shape, double period) noexcept;
  static Shape shortest(double v, double a, double most_a, double most_step, double period, const Shape& near) noexcept;
  /// Plans one joint with its shape; false where that does not keep the limits.
  bool fits(Eigen::Index joint, double q, double v, double a, const JointLimits& limits, double most_step,
            double period) noexcept;
  static bool keeps(double v, double a, double most_a, double most_step, const Shape& shape, double period) noexcept;
  double at(Eigen::Index joint, int period) const noexcept;

  /// Position of a joint after this many periods since the stop was planned.
  double place(Eigen::Index joint, int periods) const noexcept;

  /// Position and velocity of a joint at the begin of the stop, and at the begin and end of its hold.
  struct Passes {
    double q = 0.0, v = 0.0, held_q = 0.0, held_v = 0.0, left_q = 0.0, left_v = 0.0;
  };
  std::vector<Shape> shapes_, shortest_;
  std::vector<Passes> passes_;
  Eigen::VectorXd first_, hardest_, way_;
  double period_ = 0.0;
  int num_periods_ = 0, passed_ = 0;
};

}  // namespace sidestep
