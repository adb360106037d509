#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

/// Limits of one joint; a set of them is a bit mask.
enum class Limit : std::uint8_t {
  none = 0,
  position_lower = 1,
  position_upper = 2,
  velocity_lower = 4,
  velocity_upper = 8,
  acceleration_lower = 16,
  acceleration_upper = 32,
  torque_lower = 64,
  torque_upper = 128,
};

constexpr Limit operator|(Limit a, Limit b) noexcept {
  return static_cast<Limit>(static_cast<std::uint8_t>(a) | static_cast<std::uint8_t>(b));
}
constexpr bool contains(Limit set, Limit limit) noexcept {
  return (static_cast<std::uint8_t>(set) & static_cast<std::uint8_t>(limit)) != 0;
}

/// The interval of accelerations that keeps one joint inside its limits, and which limit gives either end.
struct AccelerationInterval {
  double lower, upper;
  Limit lower_limit, upper_limit;
  double position_lower, position_upper;  ///< the same without velocity and acceleration limits: wider, or equal
};

/// The limits of one joint: lower <= q <= upper, |v| <= velocity, |a| <= acceleration.
struct ScalarLimits {
  double lower, upper, velocity, acceleration;
};

// How the bounds come about, for one joint and its upper limit u (the lower one is the mirror image).
//
// The acceleration a is held for one period T, after which the velocity is w = v + aT.
//
// Braking distance. Brake with the full acceleration A for whole periods, and in the last one with just what is
// needed to stop. From v = n A T the distance is v^2/2A; a remainder of the velocity costs its mean over one period,
// which makes the distance D(v) linear between these points:
//     D(v) = n^2 A T^2 / 2 + (v - n A T)(2n + 1) T / 2,      n = floor(v / A T),      D(v) = 0 for v <= 0.
//
// Viable states: q + D(v) <= u, q - D(-v) >= l, |v| <= V. From such a state the braking a = -min(A, v/T) leads, for
// v >= 0, to q + D unchanged, w in [0, v] and a q that has not fallen: a viable state again. So an admissible
// acceleration exists from every viable state, whatever the sizes of u - l, V, A and T, and both ends of the interval
// below are safe for ever. No overshoot hides inside a period either: the path is monotone unless w has the other
// sign, and then its peak is less than vT/2 <= D(v) ahead. (The set is that of Del Prete, "Joint position and velocity
// bounds in discrete-time acceleration/torque control of robot arms", 2018, made exact for held accelerations: with
// v^2/2A in place of D(v) the last braking step may reverse, and narrow intervals fail.)
//
// Upper bound. Accept the w for which the next state is viable both under exact integration, q+ = q + vT + aT^2/2,
// and under semi-implicit Euler, q+ = q + wT (hence for everything in between):
//     q + vT + c (w - v) T + D(w) <= u,      c = 1/2 when braking (w < v), 1 when not.
// The left side increases with w and is piecewise linear, so the largest such w is a closed form.
//
// Outside the limit that inequality wants the whole way back within one period. It is enough, and gentler, to come
// back with the speed from which the same distance could be braked: w = -D^-1(excess), which reaches the limit in
// finite time and at rest. The velocity limit always stands above this, and the acceleration limit above everything:
// where no admissible acceleration exists the bounds collapse to full braking (or full steering back).

/// Distance D(speed) [rad | m] covered while braking from `speed` >= 0 to rest in whole periods.
double braking_distance(double speed, double acceleration, double period) noexcept;

/// Whether a joint can be kept inside its limits for ever from this state, up to `tolerance` [rad | m, and /s].
bool is_viable(double q, double v, const ScalarLimits& limits, double period, double tolerance = 0.0) noexcept;

/// The accelerations after which the next state is viable; see the derivation above. Never empty: lower <= upper, and
/// both within the acceleration limit. q and v finite, period > 0.
AccelerationInterval acceleration_interval(double q, double v, const ScalarLimits& limits, double period) noexcept;

/// The intervals of all joints.
struct AccelerationBounds {
  explicit AccelerationBounds(int num_coordinates);

  /// q [rad | m], v [/s] finite (nv); period [s]; the position limits are moved inwards by `position_margin`
  /// [rad | m]. No allocation.
  void update(const JointLimits& limits, ConstVectorRef q,
              ConstVectorRef v, double period, double position_margin = 0.0) noexcept;

  Eigen::VectorXd lower, upper;  ///< (nv) [rad/s^2 | m/s^2]
  std::vector<Limit> lower_limit, upper_limit;
  Eigen::VectorXd position_lower, position_upper;  ///< (nv), what the position limits alone ask for
};

}  // namespace sidestep
