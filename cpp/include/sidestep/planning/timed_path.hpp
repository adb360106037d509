#pragma once

#include <Eigen/Core>

#include "sidestep/constraints/safety_settings.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/robot/dynamics.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/planning/path_timing.hpp"

namespace sidestep {

struct TimedPathSettings {
  double speed = 1.0;  ///< Share of the velocity and acceleration limits [-]; a Controller sets it to its own.
  double wide = 0.03;  ///< Clearance below which a place is narrow [m].
  double lead = 0.4;   ///< Distance |q − q*| at which the reference waits for the arm [rad].

  /// Throws std::invalid_argument that names the setting at fault.
  void validate() const;
};
template <>
const std::vector<Field<TimedPathSettings>>& fields();

/// What a path may ask of the joints of a robot: `speed` of their velocity and acceleration limits, less 5 % that are left to
/// an arm that follows, and no velocity from which a joint moves on by more than 1.5 rad while it stops; jerk 88/s times the acceleration limit,
/// which stays below 100/s between samples. Joints without a limit: 2 rad/s, 10 rad/s² (m, alike).
PathLimits path_limits(const JointLimits& limits, double speed);

/// A path as a motion: where the reference is at which time, and how narrow the path is.
struct TimedPath {
  PathTiming motion;
  Eigen::MatrixXd places;         ///< Configurations (nv × P), 0.05 rad apart.
  Eigen::VectorXd place_station;  ///< Length of the path up to each (P) [rad].
  Eigen::VectorXd clearance;      ///< Clearance of each (P) [m], at most 0.1 m; zero where it was not measured.
  PathLimits limits;

  double length() const noexcept { return motion.station[motion.station.size() - 1]; }
  double duration() const noexcept { return static_cast<double>(motion.station.size() - 1) * motion.period; }
  Eigen::Index place_after(double station) const noexcept;
};

/// Times a path, as fast as the limits allow, from a velocity v (nv) of which what leads along the path counts.
///
/// Near obstacles the rule of ClearanceConstraints bounds the speed: with h_i the clearance of an item, whose distance left is s = h_i − margin (at least
/// 1 mm; where the path itself comes nearer than the margin, that), and A = braking_fraction |dh_i/ds| (d²s/dt²)_max, the speed
/// along the path is at most p⁻¹(s) / |dh_i/ds| where h_i shrinks. A path that is not `measured` is slow everywhere, and
/// soon made: clearances are looked at nowhere.
///
/// With the dynamics of an arm that is moved by torque, accelerations along the path take no more than 0.7 of the effort that
/// gravity leaves, and their changes no more than 0.5 of the effort's rate: at a place with s̈, s⃛ what the joints' limits allow,
///     |M q'| s̈ share <= 0.7 (effort − |g|),     |M q'| s⃛ share_of_jerk <= 0.5 effort rate,
/// the first with a share for each place (at least 0.05), the second with one for the path. Centrifugal forces are not counted.
TimedPath make_route(const RoundedPath& path, const Eigen::VectorXd& v, const ClearanceQuery& body, const Obstacles& obstacles,
                     const TimedPathSettings& settings, const SafetySettings& safety, ClearanceQuery::Workspace& workspace,
                     bool measured = true, const RigidBodyDynamics* dynamics = nullptr);

/// Where the reference is on a timed path: at a time of the motion, which goes more slowly as the reference gets ahead of the arm.
struct TimedPathFollower {
  double time = 0.0;     ///< Time of the motion [s].
  double pace = 1.0;     ///< Pace r of that time, in [0, 1].
  double change = 0.0;   ///< dr/dt [1/s].
  double station = 0.0;  ///< Station at that time [rad].
  double most = 1.0;     ///< Largest r allowed, >= 0.

  /// Onto a new path, at the sample nearest to q in the first radian, as fast as the arm moves along it at v (nv).
  void enter(const TimedPath& route, ConstVectorRef q, ConstVectorRef v) noexcept;

  static constexpr Eigen::Index most_places = 5;  // Most narrow places that are passed on.
  /// The narrow places between the reference and as far behind it as the arm may be, or every second, third, … of them:
  /// writes them into the columns of (nv × most_places), and says how many they are.
  Eigen::Index narrow(const TimedPath& route, const TimedPathSettings& settings,
                      Eigen::Ref<Eigen::MatrixXd> places) const noexcept;

  /// Moves on for `duration` [s]; writes the reference, its velocity and its acceleration (nv). The pace r follows
  ///
  ///     r* = min(1, most, 2 − 2 |q − q*| / lead)₊
  ///
  /// as a critically damped spring of 20 rad/s, its change kept where q̈ r² + q̇ dr/dt is within the path's limits.
  void advance(const TimedPath& route, const TimedPathSettings& settings, ConstVectorRef q, double duration,
               Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity,
               Eigen::Ref<Eigen::VectorXd> acceleration) noexcept;
};

}  // namespace sidestep
