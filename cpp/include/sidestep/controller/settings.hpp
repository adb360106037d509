#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sidestep/constraints/safety_settings.hpp"
#include "sidestep/constraints/speed_constraint.hpp"
#include "sidestep/attractor/local_minimum_recovery.hpp"
#include "sidestep/planning/look_ahead.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/planning/online_planner.hpp"

namespace sidestep {

/// The spring to the goal and the barriers that bend its acceleration. Units and meaning of each number: `fields<BarrierSettings>()`.
struct BarrierSettings {
  double stiffness = 4.0, damping = 4.0;
  double activation = 0.1, strength = 0.1, power = 2.0, floor = 0.002, temperature = 0.002;
  double limit_activation = 0.1, limit_strength = 0.02;
  double self_activation = 0.05, self_strength = 0.02;
};

/// When a goal counts as reached.
struct ArrivalSettings {
  double joint = 0.01;       ///< largest joint error [rad]
  double sliding = 0.001;    ///< largest error of a prismatic joint [m]
  double position = 0.001;   ///< largest distance from a pose goal [m]
  double rotation = 0.0087;  ///< largest angle from a pose goal [rad]: half a degree
  double speed = 0.05;       ///< largest joint speed [rad/s | m/s]
};

/// Feedback that keeps the arm on the controller's reference, see Controller: q̈ = a_r + ω² (q_r − q) + 2 ζ ω (v_r − v), plus the
/// torque of the disturbance observer. Not used with output position or velocity, which the arm's own drives track.
struct TrackingSettings {
  double frequency = 60.0;  ///< natural frequency ω [1/s]
  double damping = 1.0;     ///< damping ratio ζ [-]: rotor inertias that the model lacks reduce it
  /// Time constant with which predicted velocities follow measured ones [s].
  double velocity_filter = 0.004;
  double observer_time = 0.05;  ///< time constant of the observer of friction, payload and wrong gravity [s]; inf: none
  double observer_share = 0.8;  ///< largest torque of the observer, as a share of the effort limits [-]
  /// Tracking error |q_r − q| above which the reference restarts at the arm [rad]; for prismatic joints a fifth [m].
  double largest_error = 0.2;
  double servo_lag = 1.0;  ///< the same limit where the arm's own drives track the reference [rad]
  /// Stiffness κ of a compliant arm with torque output: K_j = κ (effort limit)_j [1/rad]; for prismatic joints five times as much
  /// [1/m]. 0.01 is very soft. 0 is not soft: it switches compliance off, and the arm is stiffest.
  double stiffness = 0.0;
  double drift_gain = 2.0;  ///< gain of output velocity: v = v_r + gain (q_r − q) [1/s]
};

/// When a torque that neither model, load nor friction explains stops the arm, see Controller. With torque output; not with
/// `tracking.stiffness`: such an arm is made to be pushed.
struct ContactSettings {
  double share = 0.3;  ///< largest torque that nothing explains, as a share of the effort limits [-]; inf: no stop
  double time = 0.01;  ///< time for which it has to last [s]
};

/// How velocities, twists and trajectories are followed, see Controller.
struct InputSettings {
  double response = 20.0;  ///< rate k of the response to a commanded velocity v_d: acceleration k (v_d − v) [1/s]
  double timeout = 0.25;   ///< age above which a velocity or a twist counts as zero [s]
  /// Singular value of the frame's Jacobian below which a twist is slowed; at a fifth of it the arm stops [m and rad].
  double singular = 0.05;
  double frequency = 10.0;  ///< natural frequency ω of the return to a trajectory or path, ω² e + 2 ω de/dt [1/s]
  /// Error |q_r − q*| above which a trajectory slows down; at twice as much it waits [rad]; for prismatic joints a fifth [m].
  double lead = 0.1;
};

/// How long obstacles are believed, see Controller::set_obstacles.
struct SourceSettings {
  double valid_for = 0.25;     ///< age up to which a source is believed that comes again and again, moves or has a time [s]
  double largest_speed = 2.0;  ///< largest speed of what nobody has told of [m/s]
  double empty_after = 2.0;    ///< time for which a source must stay empty before that is believed [s]
};

/// All settings of a Controller. Every part but speed_limits is on by default; an empty optional leaves a part out.
struct ControllerSettings {
  /// What is sent to the arm. Torque and acceleration are tracked by the controller, from the measured state; position and
  /// velocity by the arm's own drives. Automatic: torque where the arm has inertias and effort limits, else acceleration.
  enum class Output { automatic, torque, acceleration, velocity, position };

  double period = 0.001;  ///< time between two calls of `step` [s]
  Output output = Output::automatic;
  double speed = 1.0;  ///< share of the velocity and acceleration limits that motions use
  /// Share of the limits of velocity, acceleration, jerk and torque rate that stays unused, for noise, delay and rounding.
  double limit_margin = 0.02;
  double effort_margin = 0.05;   ///< share of the effort limits that stays unused, for errors of the model
  double position_margin = 0.0;  ///< distance by which position limits are moved inwards [rad | m]
  double stop_time = 0.1;        ///< time constant of the emergency stop [s]
  /// Joint damping of the emergency stop without a mass matrix, in units of effort limit / velocity limit. This and the next four:
  /// see MotionProgramSettings.
  double stop_damping = 0.25;
  double torque_weight = 1e-6, slack_weight = 1e3;
  double velocity_overrun = 1.2, acceleration_overrun = 10.0;
  double obstacle_timeout = std::numeric_limits<double>::infinity();  ///< age above which any source counts as stale [s]
  bool local_activation = true;  ///< shorter activation distances near goals and in narrow places, among static obstacles
  bool synchronous = false;      ///< planner, look-ahead and posture search run inside `step`, so that motions repeat
  std::uint64_t seed = 0;        ///< seed of all random numbers

  BarrierSettings barriers = {};
  SafetySettings safety = {};
  ArrivalSettings arrival = {};
  TrackingSettings tracking = {};
  ContactSettings contact = {};
  /// Limits of Cartesian speed by the distance to obstacles. Without them only joint velocities are limited.
  std::optional<SpeedLimitSettings> speed_limits = std::nullopt;
  InputSettings inputs = {};
  SourceSettings sources = {};
  std::optional<OnlinePlannerSettings> planner = OnlinePlannerSettings{};
  std::optional<LookAheadSettings> look_ahead = LookAheadSettings{};
  /// Sub-goals where the arm is stuck without a path.
  std::optional<LocalMinimumSettings> local_minimum = LocalMinimumSettings{};

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

template <> const std::vector<Field<BarrierSettings>>& fields();
template <> const std::vector<Field<ArrivalSettings>>& fields();
template <> const std::vector<Field<TrackingSettings>>& fields();
template <> const std::vector<Field<ContactSettings>>& fields();
template <> const std::vector<Field<InputSettings>>& fields();
template <> const std::vector<Field<SourceSettings>>& fields();
template <> const std::vector<Field<ControllerSettings>>& fields();

}  // namespace sidestep
