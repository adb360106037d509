#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Limits of one joint; a set of them is a bit mask.
enum class Limit : std::uint16_t {
  none = 0,
  position_lower = 1,
  position_upper = 2,
  velocity_lower = 4,
  velocity_upper = 8,
  acceleration_lower = 16,
  acceleration_upper = 32,
  torque_lower = 64,
  torque_upper = 128,
  jerk_lower = 256,
  jerk_upper = 512,
  torque_rate_lower = 1024,
  torque_rate_upper = 2048,
};

constexpr Limit operator|(Limit a, Limit b) noexcept {
  return static_cast<Limit>(static_cast<std::uint16_t>(a) | static_cast<std::uint16_t>(b));
}
constexpr bool contains(Limit set, Limit limit) noexcept {
  return (static_cast<std::uint16_t>(set) & static_cast<std::uint16_t>(limit)) != 0;
}

/// Interval of accelerations that keeps one joint inside its limits, and the limit that sets each end.
struct AccelerationInterval {
  double lower, upper;
  Limit lower_limit, upper_limit;
  double position_lower, position_upper;  ///< Interval without velocity and acceleration limits: wider, or equal.
};

/// Part of an AccelerationInterval within the jerk limit.
struct SmoothInterval {
  double lower, upper;
  Limit lower_limit, upper_limit;
};

/// Limits of one joint: lower <= q <= upper, |v| <= velocity, |a| <= acceleration.
struct ScalarLimits {
  double lower, upper, velocity, acceleration;
};

// Derivation of the bounds, for one joint and its upper limit u (the lower one is the mirror image).
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
// Outside the limit that inequality would require the whole way back within one period. It is enough, and gentler, to
// return with the speed from which the same distance could be braked: w = -D^-1(excess), which reaches the limit in finite
// time and at rest. The velocity limit always ranks above this, and the acceleration limit above everything: if no
// admissible acceleration exists, the bounds collapse to full braking (or full return).
//
// With a jerk limit J. The acceleration x of the next period is within JT of that of the last one, a, and must leave time to
// be reduced: smooth braking reduces it by J to -A, holds that, and ends at rest without acceleration. Held accelerations that
// are the means of such a profile over whole periods keep A, and J from one to the next. After x the profile continues from
// v + xT with the acceleration x - JT/2 at that moment (its mean over the next period is then not below x - JT). So x is
// viable if
//     v + xT + (x - JT/2)²/2J <= V                  (for x > JT/2; else v + xT <= V)
//     q + max(v + xT, v + xT/2) T + S(v + xT, max(x - JT/2, -A)) + wT/2 <= u,
// with S(v, a) the distance of the profile in closed form, see jerk_braking_distance, and w its largest speed, or 0: its end
// falls between two samples. Both sides rise with x. Following the profile keeps both true, so such an x exists in the next
// period again. If none exists (the state was not reached this way), jerk gives way, as little as possible, and never a limit
// above.

/// Distance D(speed) [rad | m] covered while braking from `speed` >= 0 to rest in whole periods.
double braking_distance(double speed, double acceleration, double period) noexcept;

/// Distance S [rad | m] covered until rest from a speed v [/s], any sign, and an acceleration a >= -A [/s^2], braking as hard
/// as A and the jerk J allow and ending without acceleration; at most 0 if the joint does not advance.
double jerk_braking_distance(double v, double a, double acceleration, double jerk) noexcept;

/// Whether a joint can be kept inside its limits for ever from this state, up to `tolerance` [rad | m, and /s].
bool is_viable(double q, double v, const ScalarLimits& limits, double period, double tolerance = 0.0) noexcept;

/// The velocity nearest to v from which a joint at q can be kept inside its limits for ever; beyond a position limit, the nearest
/// that does not lead farther out.
double viable_velocity(double q, double v, const ScalarLimits& limits, double period) noexcept;

/// The accelerations after which the next state is viable; see the derivation above. Never empty: lower <= upper, and
/// both within the acceleration limit. q and v finite, period > 0.
AccelerationInterval acceleration_interval(double q, double v, const ScalarLimits& limits, double period) noexcept;

/// Largest acceleration, and the limit that sets it; both false: none.
struct ReturnableAcceleration {
  double value;
  bool by_velocity = false, by_position = false;
};

/// The largest acceleration in [least, largest] that `jerk` [/s^3] can reduce in time for the upper velocity limit and for an
/// upper position limit at `distance_left`, at the velocity `speed`; see the derivation above. `least` if none fits, less if the
/// velocity limit requires it.
ReturnableAcceleration largest_returnable(double distance_left, double speed, double least, double largest,
                                          const ScalarLimits& limits, double jerk, double period) noexcept;

/// Part of `interval` within `jerk` [/s^3] of the acceleration `before` of the last period; never empty.
SmoothInterval smooth_interval(double q, double v, double before, const AccelerationInterval& interval,
                               const ScalarLimits& limits, double jerk, double period) noexcept;

/// How much the bounds of all joints are narrowed.
struct LimitMargins {
  double position = 0.0;    ///< Distance by which position limits are moved inwards [rad | m].
  double jerk_share = 1.0;  ///< Share of the jerk limits that may be used [-].
  /// Factor up to which acceleration limits may be exceeded [-]; braking does not count on it.
  double acceleration_factor = 1.0;
};

/// The intervals of all joints.
struct AccelerationBounds {
  explicit AccelerationBounds(int num_coordinates);

  /// q [rad | m], v [/s] finite (nv); period [s]; `before`: accelerations of the last period (nv) [/s^2], or null for none.
  /// No allocation.
  void update(const JointLimits& limits, ConstVectorRef q, ConstVectorRef v, double period, const LimitMargins& margins = {},
              const Eigen::VectorXd* before = nullptr) noexcept;

  /// Narrows bounds that exceed the acceleration limit (nv) to the limit or, where that is more, to the wanted acceleration (nv).
  void draw_in(const Eigen::VectorXd& limit, ConstVectorRef wanted) noexcept;

  Eigen::VectorXd lower, upper;  ///< Bounds (nv) [rad/s^2 | m/s^2].
  std::vector<Limit> lower_limit, upper_limit;
  /// Bounds with the jerk limit (nv) [rad/s^2 | m/s^2]; without a last acceleration those above.
  Eigen::VectorXd smooth_lower, smooth_upper;
  std::vector<Limit> smooth_lower_limit, smooth_upper_limit;
  Eigen::VectorXd position_lower, position_upper;  ///< Bounds of the position limits alone (nv) [rad/s^2 | m/s^2].
};

}  // namespace sidestep
