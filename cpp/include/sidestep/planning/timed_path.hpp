#pragma once

#include <Eigen/Core>

#include "sidestep/fields.hpp"
#include "sidestep/planning/body_clearance.hpp"

namespace sidestep {

struct TimedPathSettings {
  double speed = 2.0;         ///< fastest |dq*/dt| of the reference [rad/s]
  double speed_share = 0.7;   ///< of the joints' velocity limits that it may ask for
  double acceleration = 4.0;  ///< at which it slows down ahead [rad/s²]
  double wide = 0.03;         ///< clearance from which it goes at full speed [m]
  double slowest = 0.35;      ///< share of the speed that is left where there is none
  double lead = 0.4;          ///< |q − q*| at which it waits for the arm [rad]
  /// an arm leaves a corner by this times the change of velocity [s]: 1 / (e √K) if critically damped
  double delay = 0.18;

  /// Throws std::invalid_argument that names the setting at fault.
  void validate() const;
};
template <>
const std::vector<Field<TimedPathSettings>>& fields();

/// A path with the speed at which the reference may pass every point of it: slower in narrow places, at corners, and
/// before the end.
struct TimedPath {
  Eigen::MatrixXd q;        ///< (nv × K) [rad]
  Eigen::VectorXd station;  ///< length of the path up to each [rad]
  Eigen::VectorXd speed;    ///< (K) [rad/s]
  Eigen::VectorXd clearance;  ///< (K) not above `wide` [m]; zero where it was not measured

  double length() const noexcept { return station.size() > 0 ? station[station.size() - 1] : 0.0; }
};

/// Samples a path. One that is not `measured` is slow everywhere, and soon made: clearances are looked at nowhere.
TimedPath make_route(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                 const TimedPathSettings& settings, BodyClearance::Workspace& workspace, bool measured = true);

/// Where the reference is on a timed path: it runs ahead of the arm as far as that can follow.
struct TimedPathFollower {
  double station = 0.0;
  double rate = 0.0;    ///< its speed along the path [rad/s]
  Eigen::Index at = 0;  ///< the sample before it

  /// Onto a new path, at the sample nearest to q among the first ones, as fast as the arm moves along it at v (nv).
  void enter(const TimedPath& route, ConstVectorRef q, ConstVectorRef v) noexcept;

  static constexpr Eigen::Index most_places = 5;
  /// The narrow samples between the reference and as far behind it as the arm may be, or every second, third, … of
  /// them: writes them into the columns of (nv × most_places), and says how many they are.
  Eigen::Index narrow(const TimedPath& route, const TimedPathSettings& settings, Eigen::Ref<Eigen::MatrixXd> places) const noexcept;

  /// Moves on for `duration` [s]; writes the reference, its velocity and, along the path, its acceleration (nv).
  void advance(const TimedPath& route, const TimedPathSettings& settings, ConstVectorRef q, double duration,
               Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity,
               Eigen::Ref<Eigen::VectorXd> acceleration) noexcept;
};

}  // namespace sidestep
