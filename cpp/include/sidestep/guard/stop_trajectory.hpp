#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// A stop within the limits of acceleration and jerk, known to its end: the fail-safe manoeuvre of Pek and Althoff ("Fail-safe
/// motion planning for online verification of autonomous vehicles", 2018), for a joint space.
///
/// Joint j has the acceleration a_j and the velocity v_j, and accelerations are held for periods T. In r periods its
/// acceleration goes linearly to −p_j, stays there for m periods, and in r more goes linearly to zero. The velocity is zero then,
/// exactly, if
///
///     p_j = (v_j/T + a_j (r − 1)/2) / (r + m).
///
/// All joints have the same r and m, the least of two shapes with which every joint keeps its limits: the arm stops nearly along
/// its path. A joint that would leave its position or velocity limits so has the least r and m of its own.
class StopTrajectory {
 public:
  explicit StopTrajectory(int num_coordinates);

  /// Plans the stop from q [rad | m], v [/s], a [/s²] (nv), finite; period T [s]. Of jerk limits it takes `jerk_share`. False where
  /// no stop with ramps of at most `most_periods` keeps acceleration, position and velocity limits. No allocation.
  [[nodiscard]] bool plan(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a, const JointLimits& limits, double period,
                          double jerk_share = 1.0) noexcept;

  /// The periods that are left until rest.
  int num_periods() const noexcept { return num_periods_ - passed_; }
  /// By how much every joint moves at most, from where the stop was planned on (nv) [rad | m].
  const Eigen::VectorXd& way() const noexcept { return way_; }
  /// The acceleration between the ramps (nv) [/s²].
  const Eigen::VectorXd& hardest() const noexcept { return hardest_; }
  /// Writes the acceleration (nv) [/s²] in the period that begins in `periods`.
  void acceleration(int periods, Eigen::VectorXd& a) const noexcept;
  /// Writes the configuration (nv) [rad | m] after so many periods.
  void position(int periods, Eigen::VectorXd& q) const noexcept;
  /// Goes on by a period.
  void advance() noexcept { ++passed_; }

  static constexpr int most_periods = 4000;

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

  /// Where joint `joint` is after so many periods since the stop was planned.
  double place(Eigen::Index joint, int periods) const noexcept;

  /// Of a joint where it begins, where its hold begins and where it ends.
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
