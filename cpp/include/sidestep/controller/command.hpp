#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "sidestep/constraints/acceleration_bounds.hpp"

namespace sidestep {

/// How safe a command is, by severity. Every command may be sent; before a usable state was known its position is NaN, and nothing
/// is to be sent to drives that take positions.
enum class SafetyStatus {
  ok,              ///< the motion is what the goal asks for, or within 5 % of the velocity or twist that was asked for
  limited,         ///< a limit of the arm or a clearance changes it
  relaxed,         ///< limits of jerk, joint or Cartesian speed, or acceleration gave way to clearances, position
                   ///< or torque limits
  margin_lost,     ///< not every safety margin or position limit can be kept; nothing is touched
  tracking_lost,   ///< the arm is more than 0.1 s at its velocity limits from where it is commanded, or its measured position
                   ///< agrees with no motion: the arm comes to rest
  stale,           ///< the obstacles are older than `obstacle_timeout`, or were never set although it is: the arm stops
  stopping,        ///< the input is unusable or the program was not solved: a damped stop
  clearance_lost,  ///< an ellipsoid of the arm reaches into an obstacle, a plane or another link
};

/// What a controller is doing.
enum class Activity {
  no_goal,  ///< no goal, or no velocity for a while: the arm comes to rest, and avoids moving obstacles
  moving,   ///< on the way to its goal, or at the commanded velocity
  waiting,  ///< until a posture is found, or until its trajectory is free
  arrived,  ///< the goal is reached
  blocked,  ///< no path leads to the goal, for 0.2 s at least, see `explain`; the arm goes as near as it can
  stale,    ///< as SafetyStatus::stale: the arm stops
};

/// Short names, for example "clearance_lost".
const char* to_string(SafetyStatus status) noexcept;
const char* to_string(Activity activity) noexcept;

/// The result of one step. Each step overwrites it.
struct Command {
  explicit Command(int num_coordinates);

  SafetyStatus status = SafetyStatus::stopping;
  Activity activity = Activity::no_goal;
  Eigen::VectorXd torque;                  ///< (nv) [Nm | N], gravity included; zero where the output is not torque
  Eigen::VectorXd torque_without_gravity;  ///< (nv) for arms that compensate gravity; NaN where the arm has no inertias
  Eigen::VectorXd wanted;                  ///< (nv) acceleration after barriers, before any limit [rad/s² | m/s²]
  Eigen::VectorXd acceleration;            ///< (nv) of the arm: the reference's with feedback [rad/s² | m/s²]
  Eigen::VectorXd velocity;                ///< (nv) of the reference after this period [rad/s | m/s]
  Eigen::VectorXd position;                ///< (nv) of the reference after this period [rad | m]; NaN until a state was known
  Eigen::VectorXd disturbance;             ///< (nv) force that the observer compensates, for torque output [Nm | N]
  Eigen::VectorXd rotors;                  ///< (nv) estimated inertia that the model lacks [kg m² | kg]
  double tracking_error = 0.0;             ///< largest |q_r − q| [rad | m]
  double deviation = 0.0;                  ///< of the reference from the straight lines between a trajectory's samples, in the
                                           ///< farthest joint [rad | m], see JointTrajectory::deviation
  double delay = 0.0;                      ///< how far the trajectory's clock is behind [s]
  /// (nv) What is changed of the velocity, twist or trajectory that was asked for [rad/s | m/s]: velocity of the reference after
  /// this period, less the velocity asked for. Of a twist V: J⁺ (J v − V), damped where it is singular, so that what the frame
  /// does not feel does not count. Of a trajectory: its velocity at the clock, at full speed. Zero without one of these.
  Eigen::VectorXd input_change;

  /// least clearance of the covering body [m], exact below the barriers' activation distances; inf: far; NaN: the state is
  /// unknown
  double clearance = std::numeric_limits<double>::infinity();
  int coordinate = -1;  ///< whose clearance that is, see Controller::labels; -1: none within reach
  int point = -1;       ///< the obstacle point, where it is one
  int bound_by = -1;    ///< the coordinate whose clearance row bends the motion most; -1: none
  /// distance to the nearest obstacle [m], exact up to speed_limits.far_distance; inf: farther, or without these settings;
  /// NaN: the state is unknown
  double distance = std::numeric_limits<double>::infinity();
  double speed = 0.0;                                            ///< of the arm's fastest frame [m/s]; NaN: unknown
  double speed_limit = std::numeric_limits<double>::infinity();  ///< for every frame [m/s]; inf: none; NaN: unknown
  std::vector<Limit> limits;                                     ///< (nv) the limits in the way of each joint

  bool avoiding = false;  ///< it follows an avoidance trajectory of the look-ahead
  bool on_path = false;   ///< it follows a path of the planner
  /// How old results of the threads beside the loop are.
  struct Background {
    /// Time since the state from which the newest result that is followed was computed [s]: it grows where threads get too little
    /// processor time, or steps come faster than real time. 0: the part is off, runs inside `step`, or has nothing to do.
    double look_ahead_age = 0.0, planner_age = 0.0;
    double pace = 1.0;  ///< share of its speed that the age of the look-ahead leaves the arm, see LookAheadSettings::pace
  } background;
};

/// Calls visit(name, field) for every field. A new field does not compile until it is named here.
template <class C, class Visit>
void each_field(C& command, Visit&& visit) {
  auto& [status, activity, torque, torque_without_gravity, wanted, acceleration, velocity, position, disturbance, rotors,
         tracking_error, deviation, delay, input_change, clearance, coordinate, point, bound_by, distance, speed, speed_limit,
         limits, avoiding, on_path, background] = command;
  auto& [look_ahead_age, planner_age, pace] = background;
  visit("status", status);
  visit("activity", activity);
  visit("torque", torque);
  visit("torque_without_gravity", torque_without_gravity);
  visit("wanted", wanted);
  visit("acceleration", acceleration);
  visit("velocity", velocity);
  visit("position", position);
  visit("disturbance", disturbance);
  visit("rotors", rotors);
  visit("input_change", input_change);
  visit("tracking_error", tracking_error);
  visit("deviation", deviation);
  visit("delay", delay);
  visit("clearance", clearance);
  visit("coordinate", coordinate);
  visit("point", point);
  visit("bound_by", bound_by);
  visit("distance", distance);
  visit("speed", speed);
  visit("speed_limit", speed_limit);
  visit("limits", limits);
  visit("avoiding", avoiding);
  visit("look_ahead_age", look_ahead_age);
  visit("planner_age", planner_age);
  visit("pace", pace);
  visit("on_path", on_path);
}

}  // namespace sidestep
