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

/// The spring that pulls to the goal, and the barriers that bend its way.
struct BarrierSettings {
  double stiffness = 4.0, damping = 4.0;
  double activation = 0.1, strength = 0.1, power = 2.0, floor = 0.002, temperature = 0.002;
  double limit_activation = 0.1, limit_strength = 0.02;
  double self_activation = 0.05, self_strength = 0.02;
};

/// When a goal counts as reached.
struct ArrivalSettings {
  double joint = 0.01;       ///< largest joint error [rad]
  double sliding = 0.001;    ///< the same of sliding joints [m]
  double position = 0.001;   ///< of a pose goal [m]
  double rotation = 0.0087;  ///< of a pose goal [rad]: half a degree
  double speed = 0.05;       ///< largest joint speed [rad/s | m/s]
};

/// How the arm is kept on the controller's reference, see Controller: q̈ = a_r + ω² (q_r − q) + 2 ζ ω (v_r − v), with what the
/// disturbance observer found. Not for outputs of position and velocity, which the arm's own drives track.
struct TrackingSettings {
  double frequency = 60.0;  ///< ω [1/s]
  double damping = 1.0;     ///< ζ [-]: rotors that the model does not know lower it
  /// Time constant by which measured velocities are drawn to [s]: prediction takes its place within.
  double velocity_filter = 0.004;
  double observer_time = 0.05;  ///< time constant of the observer of friction, payload and wrong gravity [s]; inf: none
  double observer_share = 0.8;  ///< of the effort limits that it may make up for [-]
  /// |q_r − q| from which the reference begins anew at the arm [rad]; of sliding joints a fifth [m].
  double largest_error = 0.2;
  double servo_lag = 1.0;  ///< the same where the arm's own drives track the reference [rad]
  /// κ of an impedance around the reference, for arms that are moved by torque: K_j = κ (effort limit)_j [1/rad]; of sliding joints
  /// five times as much [1/m]. 0: none.
  double stiffness = 0.0;
  double drift_gain = 2.0;  ///< of the output of velocity: v = v_r + gain (q_r − q) [1/s]
};

/// How velocities, twists and trajectories are followed, see Controller.
struct InputSettings {
  double response = 20.0;   ///< k of a velocity that is wanted: acceleration k (v_d − v) [1/s]
  double timeout = 0.25;    ///< age from which a velocity or a twist counts as zero [s]
  double singular = 0.05;   ///< singular value of a frame's Jacobian near which a twist is slowed; rest at a fifth [m and rad]
  double frequency = 10.0;  ///< ω of the return to a trajectory or path, ω² e + 2 ω de/dt [1/s]
  /// |q_r − q*| from which a trajectory slows down; it waits at twice as much [rad]; of sliding joints a fifth [m].
  double lead = 0.1;
};

/// All settings of a Controller. Every part but speed_limits is on by default; an empty optional leaves a part out.
struct ControllerSettings {
  /// What is sent to the arm. Torque and acceleration are tracked by the controller, from the measured state; position and
  /// velocity by the arm's own drives. Automatic: torque where the arm has inertias and effort limits, else acceleration.
  enum class Output { automatic, torque, acceleration, velocity, position };

  double period = 0.001;  ///< between two calls of `step` [s]
  Output output = Output::automatic;
  double speed = 1.0;  ///< share of the velocity and acceleration limits that motions use
  /// Share of the limits of velocity, acceleration, jerk and torque rate that is left for noise, delay and rounding.
  double limit_margin = 0.02;
  double effort_margin = 0.05;   ///< share of the effort limits that is left for what the model lacks
  double position_margin = 0.0;  ///< position limits are moved inwards by this much [rad | m]
  double stop_time = 0.1;        ///< time constant of the damped stop [s]
  /// of a stop without a mass matrix, see MotionProgramSettings; so are the next four
  double stop_damping = 0.25;
  double torque_weight = 1e-6, slack_weight = 1e3;
  double velocity_overrun = 1.2, acceleration_overrun = 10.0;
  double obstacle_timeout = std::numeric_limits<double>::infinity();  ///< age from which obstacles count as stale [s]
  bool local_activation = true;  ///< barriers leave room at goals and narrow places among what rests
  bool synchronous = false;      ///< planner, look-ahead and posture search run inside `step`, so that motions repeat
  std::uint64_t seed = 0;        ///< of every random draw

  BarrierSettings barriers = {};
  SafetySettings safety = {};
  ArrivalSettings arrival = {};
  TrackingSettings tracking = {};
  /// limits of Cartesian speed by the distance to obstacles; without them only joint velocities are limited
  std::optional<SpeedLimitSettings> speed_limits = std::nullopt;
  InputSettings inputs = {};
  std::optional<OnlinePlannerSettings> planner = OnlinePlannerSettings{};
  std::optional<LookAheadSettings> look_ahead = LookAheadSettings{};
  /// sub-goals where the arm is stuck without a path
  std::optional<LocalMinimumSettings> local_minimum = LocalMinimumSettings{};

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

template <> const std::vector<Field<BarrierSettings>>& fields();
template <> const std::vector<Field<ArrivalSettings>>& fields();
template <> const std::vector<Field<TrackingSettings>>& fields();
template <> const std::vector<Field<InputSettings>>& fields();
template <> const std::vector<Field<ControllerSettings>>& fields();

}  // namespace sidestep
