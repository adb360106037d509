#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "sidestep/clearance/boltzmann_mean.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Horizon of the critical sample.
///
/// An arm that stops along its path in the time 2τ, with closing speeds that fall linearly, stops at a clearance of h + τ h'
/// from points that it approaches in a straight line, and at more from points that it passes. The critical sample is the one
/// of the smallest h + τ h'. It is not always the nearest, past which the arm may move.
struct Horizon {
  double time = 0.0;                                           ///< Time τ of the stop [s].
  double distance = -std::numeric_limits<double>::infinity();  ///< Largest h + τ h' at which a sample counts [m].

  static constexpr double longest = 0.5;  ///< Longest τ [s], whatever the limits.
  /// Least τ for obstacles [s], unless an avoidance trajectory leads the arm past them: they may come at an arm at rest, and
  /// motors may brake less hard than the limits say.
  static constexpr double of_obstacles = 0.3;

  /// τ = max_j |v_j| / (acceleration limit)_j / 2.
  static double of_stop(const Eigen::VectorXd& v, const JointLimits& limits) noexcept {
    double time = 0.0;
    for (Eigen::Index j = 0; j < v.size(); ++j) {
      time = std::max(time, 0.5 * std::abs(v[j]) / limits.acceleration[j]);  // keeps `time` if not a number
    }
    return std::min(time, longest);
  }

  /// Largest closing speed n·v of a ball that moves with v, towards a point at x from its centre: the unit vector n goes from
  /// any place in the ball to that point. Arguments: along = x·v, |x|, the radius of the ball, and |v|.
  static double closing_speed(double along, double distance, double radius, double speed) noexcept {
    const double sine = radius / distance, component = along / distance;
    const double cosine = std::sqrt(std::max(0.0, 1.0 - sine * sine));
    if (!(sine < 1.0) || component >= speed * cosine) {
      return speed;
    }
    return component * cosine + std::sqrt(std::max(0.0, speed * speed - component * component)) * sine;
  }
};

/// Reduces samples of a clearance to the critical one, see Horizon: the means of h, h', h'' and ∂h, with
/// weights exp(−(h + τ h')/T).
class StoppingClearance {
 public:
  StoppingClearance(double temperature, double horizon) noexcept : inverse_T_(1.0 / temperature), horizon_(horizon) {}

  void add(const ClearanceSample& sample) noexcept;

  /// The mean of what was added; not to be called before.
  ClearanceSample result() const noexcept;

 private:
  double inverse_T_, horizon_;
  double reference_ = std::numeric_limits<double>::infinity();
  double weight_ = 0.0;
  ClearanceSample sum_{};
};

}  // namespace sidestep
