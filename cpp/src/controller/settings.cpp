#include "sidestep/controller/settings.hpp"

#include <limits>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

constexpr double none = std::numeric_limits<double>::infinity();  // no bound
constexpr double most_seed = 1.8446744073709552e19;

}  // namespace

template <>
const std::vector<Field<BarrierSettings>>& fields() {
  using S = BarrierSettings;
  static const std::vector<Field<S>> all{
      {"stiffness", &S::stiffness, "1/s^2", 0.01, 100.0, "of the spring to the goal: larger is faster and brakes later"},
      {"damping", &S::damping, "1/s", 0.1, 50.0, "of the spring: 2 sqrt(stiffness) does not overshoot; larger is slower"},
      {"activation", &S::activation, "m", 0.01, 1.0,
       "clearance to obstacles at which barriers begin: larger turns earlier and gentler, smaller passes narrower gaps"},
      {"strength", &S::strength, "-", 1e-4, 10.0, "of obstacle barriers: larger turns the motion away earlier"},
      {"power", &S::power, "-", 2.0, 6.0, "of all barriers: larger stays flat longer and rises steeper"},
      {"floor", &S::floor, "m", 1e-4, 0.02, "clearance below which the arm counts as inside and is pushed out"},
      {"temperature", &S::temperature, "m", 1e-4, 0.02,
       "smoothing over points and ellipsoids: larger is smoother and less exact"},
      {"limit_activation", &S::limit_activation, "rad", 0.01, 1.0,
       "way to a position limit at which its barrier begins; of a sliding joint at most a twentieth of its range"},
      {"limit_strength", &S::limit_strength, "-", 1e-4, 10.0, "of position limits' barriers"},
      {"self_activation", &S::self_activation, "m", 0.005, 0.5, "clearance between links at which their barrier begins"},
      {"self_strength", &S::self_strength, "-", 1e-4, 10.0, "of the barriers between links"},
  };
  return all;
}

template <>
const std::vector<Field<ArrivalSettings>>& fields() {
  using S = ArrivalSettings;
  static const std::vector<Field<S>> all{
      {"joint", &S::joint, "rad", 1e-6, 1.0, "largest joint error that counts as arrived"},
      {"sliding", &S::sliding, "m", 1e-6, 1.0, "the same of sliding joints"},
      {"position", &S::position, "m", 1e-6, 1.0, "distance from a pose goal that counts as arrived"},
      {"rotation", &S::rotation, "rad", 1e-6, 3.0, "angle from a pose goal that counts as arrived"},
      {"speed", &S::speed, "rad/s", 1e-6, 100.0, "largest joint speed that counts as arrived"},
  };
  return all;
}

template <>
const std::vector<Field<TrackingSettings>>& fields() {
  using S = TrackingSettings;
  static const std::vector<Field<S>> all{
      {"frequency", &S::frequency, "1/s", 1.0, 300.0,
       "of the feedback to the reference: larger is stiffer, and shakes with noise and delay"},
      {"damping", &S::damping, "-", 0.1, 10.0,
       "of the feedback: 1 is critical; unknown rotor inertias lower it, delay and noise ask for less"},
      {"velocity_filter", &S::velocity_filter, "s", 1e-5, 1.0,
       "of measured velocities, against what was predicted: longer is calmer and later"},
      {"observer_time", &S::observer_time, "s", 0.005, none,
       "in which friction, payload and wrong gravity are taken up: shorter is stiffer, and shakes with noise and delay"},
      {"observer_share", &S::observer_share, "-", 0.0, 1.0, "of the effort limits that the observer may make up for"},
      {"largest_error", &S::largest_error, "rad", 0.001, 10.0,
       "between arm and reference, from which the reference begins anew"},
      {"servo_lag", &S::servo_lag, "rad", 0.001, 10.0, "the same where the arm's own drives track position or velocity"},
      {"stiffness", &S::stiffness, "1/rad", 0.0, 100.0,
       "of an impedance around the reference, effort limits per radian: lower yields more to pushes and payloads; 0: tracked stiffly"},
      {"drift_gain", &S::drift_gain, "1/s", 0.0, 50.0, "by which an output of velocity returns to the reference"},
  };
  return all;
}

template <>
const std::vector<Field<InputSettings>>& fields() {
  using S = InputSettings;
  static const std::vector<Field<S>> all{
      {"response", &S::response, "1/s", 1.0, 100.0, "to a velocity that is wanted: larger is quicker, and passes on its noise"},
      {"timeout", &S::timeout, "s", 0.001, none, "age from which a velocity or a twist counts as zero"},
      {"singular", &S::singular, "-", 1e-4, 1.0,
       "singular value of a frame's Jacobian [m and rad] near which a twist is slowed; it rests at a fifth of it: larger is calmer, and "
       "stops farther from where the arm is stretched"},
      {"frequency", &S::frequency, "1/s", 1.0, 50.0,
       "of the return to a trajectory or to the planner's path: larger is stiffer"},
      {"lead", &S::lead, "rad", 0.001, 10.0,
       "error from which a trajectory slows down, to a halt at twice as much; of sliding joints a fifth [m]"},
  };
  return all;
}

template <>
const std::vector<Field<ControllerSettings>>& fields() {
  using S = ControllerSettings;
  static const std::vector<Field<S>> all{
      {"period", &S::period, "s", 1e-4, 0.1, "between two calls of step; limits and clearances hold at samples so far apart"},
      {"speed", &S::speed, "-", 0.01, 1.0,
       "share of the velocity and acceleration limits that motions use: less is slower and calmer"},
      {"limit_margin", &S::limit_margin, "-", 0.0, 0.5,
       "share of the limits of velocity, acceleration, jerk and torque rate that is left for noise, delay and rounding"},
      {"effort_margin", &S::effort_margin, "-", 0.0, 0.5, "share of the effort limits that is left for what the model lacks"},
      {"position_margin", &S::position_margin, "rad", 0.0, 1.0, "by which position limits are moved inwards"},
      {"stop_time", &S::stop_time, "s", 0.005, 10.0, "time constant of the damped stop"},
      {"stop_damping", &S::stop_damping, "-", 1e-3, 10.0,
       "of a stop where the mass matrix is unusable, as a share of effort limit / velocity limit"},
      {"torque_weight", &S::torque_weight, "-", 0.0, 1e3, "price of torque against tracking: larger saves torque and sags"},
      {"slack_weight", &S::slack_weight, "-", 1.0, 1e6, "price of leaving velocity and acceleration limits against tracking"},
      {"velocity_overrun", &S::velocity_overrun, "-", 1.0, 10.0, "factor up to which velocity limits give way to clearances"},
      {"acceleration_overrun", &S::acceleration_overrun, "-", 1.0, 100.0,
       "factor up to which acceleration limits give way to clearances"},
      {"obstacle_timeout", &S::obstacle_timeout, "s", 0.001, none, "age from which obstacles are stale and the arm stops"},
      {"local_activation", &S::local_activation, "-", 0.0, 1.0,
       "barriers leave room at goals and narrow places among what rests; without it the arm creeps there"},
      {"synchronous", &S::synchronous, "-", 0.0, 1.0,
       "planner, look-ahead and posture search run inside step: motions repeat bit for bit, steps take longer"},
      {"seed", &S::seed, "-", 0.0, most_seed, "of every random draw"},
  };
  return all;
}

void ControllerSettings::validate() const {
  check_fields("controller: ", *this);
  check_fields("controller: barriers.", barriers);
  check_fields("controller: safety.", safety);
  check_fields("controller: arrival.", arrival);
  check_fields("controller: tracking.", tracking);
  check_fields("controller: inputs.", inputs);
  if (!(barriers.floor < barriers.activation && barriers.floor < barriers.self_activation)) {
    throw std::invalid_argument("controller: barriers.floor is " + std::to_string(barriers.floor) +
                                " m, allowed: below barriers.activation and barriers.self_activation");
  }
  if (speed_limits) {
    check_fields("controller: speed_limits.", *speed_limits);
    speed_limits->validate();
  }
  if (planner) {
    check_fields("controller: planner.", *planner);
    check_fields("controller: planner.search.", planner->search);
    check_fields("controller: planner.route.", planner->route);
    planner->search.validate();
  }
  if (look_ahead) {
    check_fields("controller: look_ahead.", *look_ahead);
    look_ahead->validate();
  }
  if (local_minimum) {
    check_fields("controller: local_minimum.", *local_minimum);
  }
}

}  // namespace sidestep
