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

/// Limits of a path on the joints of a robot: `speed` times their velocity and acceleration limits, less 5 % for feedback, and
/// no velocity from which a joint needs more than 1.5 rad to stop. Jerk: 88/s times the acceleration limit, which stays below
/// 100/s between samples. Joints without a limit: 2 rad/s, 10 rad/s² (or m).
PathLimits path_limits(const JointLimits& limits, double speed);

/// A path as a motion: the reference over time, and the clearance along the path.
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

/// Times a path, as fast as the limits allow, from the part of a velocity v (nv) that leads along the path.
///
/// Near obstacles the rule of ClearanceConstraints bounds the speed. Let h_i be the clearance of an item, s = h_i − margin its
/// distance left (at least 1 mm; the margin is smaller where the path itself comes closer) and
/// A = braking_fraction |dh_i/ds| (d²s/dt²)_max. Where h_i shrinks, the speed along the path is at most p⁻¹(s) / |dh_i/ds|. A path
/// that is not `measured` is slow everywhere but quickly made: it needs no clearances.
///
/// With the dynamics of an arm that is moved by torque, accelerations along the path use at most 0.7 of the effort that gravity
/// leaves, and their changes at most 0.5 of the effort's rate. With s̈, s⃛ at a place by the joint limits,
///     |M q'| s̈ share <= 0.7 (effort − |g|),     |M q'| s⃛ share_of_jerk <= 0.5 effort rate,
/// the first with a share for each place (at least 0.05), the second with one for the path. Centrifugal forces are not counted.
TimedPath make_route(const RoundedPath& path, const Eigen::VectorXd& v, const ClearanceQuery& body, const Obstacles& obstacles,
                     const TimedPathSettings& settings, const SafetySettings& safety, ClearanceQuery::Workspace& workspace,
                     bool measured = true, const RigidBodyDynamics* dynamics = nullptr);

/// Place of the reference on a timed path: a time of the motion, which runs slower as the reference gets ahead of the arm.
struct TimedPathFollower {
  double time = 0.0;     ///< Time of the motion [s].
  double pace = 1.0;     ///< Pace r of that time, in [0, 1].
  double change = 0.0;   ///< dr/dt [1/s].
  double station = 0.0;  ///< Station at that time [rad].
  double most = 1.0;     ///< Largest r allowed, >= 0.

  /// Enters a new path, at the sample nearest to q in the first radian, with the speed of v (nv) along it.
  void enter(const TimedPath& route, ConstVectorRef q, ConstVectorRef v) noexcept;

  static constexpr Eigen::Index most_places = 5;  // Most narrow places that are passed on.
  /// Writes the narrow places between the reference and the farthest place of the arm behind it, or every second, third, … of
  /// them, into the columns of (nv × most_places). Returns their number.
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
