#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "sidestep/constraints/acceleration_bounds.hpp"

namespace sidestep {

/// How safe a command is, by severity. Every command may be sent; before a usable state was known its position is NaN, and nothing
/// is to be sent to drives that take positions.
enum class SafetyStatus {
  ok,              ///< the motion is as requested; a velocity or twist is kept within 5 %
  limited,         ///< a limit of the arm or a clearance changes it
  relaxed,         ///< limits of jerk, joint or Cartesian speed, or acceleration gave way to clearances, position
                   ///< or torque limits
  margin_lost,     ///< not every safety margin or position limit can be kept; nothing is touched
  tracking_lost,   ///< the arm is farther from the command than its velocity limits cover in 0.1 s, or no motion explains its
                   ///< measured position: it comes to rest
  stale,           ///< a source of obstacles is overdue, or none was ever set: the arm stops
  stopping,        ///< the input is unusable, the quadratic program was not solved, or the arm feels a torque that nothing
                   ///< explains: a damped stop
  clearance_lost,  ///< an ellipsoid of the arm reaches into an obstacle, a plane or another link
};

/// What a controller is doing.
enum class Activity {
  no_goal,  ///< no goal, or the commanded velocity is too old: the arm comes to rest, and avoids moving obstacles
  moving,   ///< on the way to its goal, or following a velocity, twist or trajectory
  waiting,  ///< waiting until a posture is found, its trajectory is free, after a touch for `restart`, or paused for `resume`
  arrived,  ///< the goal is reached
  blocked,  ///< no path leads to the goal, for at least 0.2 s, see `explain`; the arm goes as near as it can
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
  Eigen::VectorXd torque;                  ///< (nv) [Nm | N], gravity included; zero without torque output
  Eigen::VectorXd torque_without_gravity;  ///< (nv) for arms that compensate gravity; NaN if the arm has no inertias
  Eigen::VectorXd wanted;                  ///< (nv) desired acceleration: after barriers, before any limit [rad/s² | m/s²]
  Eigen::VectorXd acceleration;            ///< (nv) of the arm: that of the reference plus feedback [rad/s² | m/s²]
  Eigen::VectorXd velocity;                ///< (nv) of the reference after this period [rad/s | m/s]
  Eigen::VectorXd position;                ///< (nv) of the reference after this period [rad | m]; NaN until a state was known
  /// What torque output finds beside its model (nv).
  struct Observed {
    Eigen::VectorXd disturbance;  ///< force that is compensated [Nm | N]
    Eigen::VectorXd rotors;       ///< estimated inertia that the model lacks [kg m² | kg]
  } observed;
  double tracking_error = 0.0;  ///< largest |q_r − q| [rad | m]
  double deviation = 0.0;       ///< of the reference from the straight lines between a trajectory's samples, in the
                                ///< farthest joint [rad | m], see JointTrajectory::deviation
  double delay = 0.0;           ///< time by which the trajectory's clock is late [s]
  /// (nv) Difference between the velocity of the reference after this period and the requested one [rad/s | m/s]. For a twist V:
  /// J⁺ (J v − V), damped near singularities; motion in the null space of J does not count. For a trajectory the requested
  /// velocity is that at its clock, at full speed. Zero without one of these.
  Eigen::VectorXd input_change;

  /// Least clearance of the covering body [m], exact below the barriers' activation distances; inf: far; NaN: the state is
  /// unknown
  double clearance = std::numeric_limits<double>::infinity();
  int coordinate = -1;  ///< index in Controller::labels of the pair with the least clearance; -1: nothing is near
  int point = -1;       ///< index of the obstacle point of that pair; -1: none
  int bound_by = -1;    ///< index in Controller::labels of the clearance that changes the motion most; -1: none
  /// Distance to the nearest obstacle [m], exact up to speed_limits.far_distance; inf: farther, or without these settings;
  /// NaN: the state is unknown
  double distance = std::numeric_limits<double>::infinity();
  double speed = 0.0;                                            ///< of the arm's fastest frame [m/s]; NaN: unknown
  double speed_limit = std::numeric_limits<double>::infinity();  ///< for every frame [m/s]; inf: none; NaN: unknown
  std::vector<Limit> limits;                                     ///< (nv) limits that restrict each joint

  bool avoiding = false;  ///< whether the arm follows an avoidance trajectory
  bool on_path = false;   ///< whether the arm follows a path of the planner
  /// Ages of the results of the threads beside the loop.
  struct Background {
    /// Age of the newest result: time since the state that it started from [s]. It grows if threads get too little processor
    /// time, or if steps come faster than real time. 0: the part is off, runs inside `step`, or has nothing to do.
    double look_ahead_age = 0.0, planner_age = 0.0;
    double pace = 1.0;  ///< share of its speed that the arm may use near moving obstacles, see LookAheadSettings::pace
  } background;
  /// How often `step` is called, against the period of the settings.
  struct Timing {
    /// Measured period for which the step commands [s]: that of the settings, unless the last steps came otherwise.
    double measured_period = 0.0;
    int late_steps = 0;      ///< steps so far that came more than 1.5 periods after the one before
    int missed_periods = 0;  ///< periods so far in which a step was missing
  } timing;
};

/// Calls visit(name, field) for every field. A new field does not compile until it is named here.
template <class C, class Visit>
void each_field(C& command, Visit&& visit) {
  auto& [status, activity, torque, torque_without_gravity, wanted, acceleration, velocity, position, observed, tracking_error,
         deviation, delay, input_change, clearance, coordinate, point, bound_by, distance, speed, speed_limit, limits, avoiding,
         on_path, background, timing] = command;
  auto& [disturbance, rotors] = observed;
  auto& [look_ahead_age, planner_age, pace] = background;
  auto& [measured_period, late_steps, missed_periods] = timing;
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
  visit("measured_period", measured_period);
  visit("late_steps", late_steps);
  visit("missed_periods", missed_periods);
}

}  // namespace sidestep
