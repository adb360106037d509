#include "sidestep/controller/settings.hpp"

#include <limits>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

constexpr double none = std::numeric_limits<double>::infinity();  // Stands for no bound.
constexpr double most_seed = 1.8446744073709552e19;

}  // namespace

template <>
const std::vector<Field<BarrierSettings>>& fields() {
  using S = BarrierSettings;
  static const std::vector<Field<S>> all{
      {"stiffness", &S::stiffness, "1/s^2", 0.01, 100.0,
       "stiffness of the spring to the goal: larger is faster and brakes later"},
      {"damping", &S::damping, "1/s", 0.1, 50.0,
       "damping of that spring: 2 sqrt(stiffness) does not overshoot, larger is slower"},
      {"activation", &S::activation, "m", 0.01, 1.0,
       "activation distance of obstacle barriers: with a larger one the arm turns earlier and more gently, with a "
       "smaller one it passes narrower gaps"},
      {"strength", &S::strength, "-", 1e-4, 10.0, "strength of obstacle barriers: larger turns the motion away earlier"},
      {"power", &S::power, "-", 2.0, 6.0, "exponent of all barriers: larger acts less far away and more steeply near contact"},
      {"floor", &S::floor, "m", 1e-4, 0.02, "clearance below which the arm counts as inside a barrier and is pushed out"},
      {"temperature", &S::temperature, "m", 1e-4, 0.02,
       "smoothing length of the mean over near points and ellipsoids: larger is smoother and less exact"},
      {"limit_activation", &S::limit_activation, "rad", 0.01, 1.0,
       "activation distance of position limits; for a prismatic joint at most a twentieth of its range"},
      {"limit_strength", &S::limit_strength, "-", 1e-4, 10.0,
       "strength of the barriers of position limits: larger turns the motion away earlier"},
      {"self_activation", &S::self_activation, "m", 0.005, 0.5,
       "activation distance between links of the arm: larger keeps them farther apart, smaller leaves more postures free"},
      {"self_strength", &S::self_strength, "-", 1e-4, 10.0,
       "strength of the barriers between links: larger turns the motion away earlier"},
  };
  return all;
}

template <>
const std::vector<Field<ArrivalSettings>>& fields() {
  using S = ArrivalSettings;
  static const std::vector<Field<S>> all{
      {"joint", &S::joint, "rad", 1e-6, 1.0, "largest joint error that counts as arrived"},
      {"sliding", &S::sliding, "m", 1e-6, 1.0, "largest error of a prismatic joint that counts as arrived"},
      {"position", &S::position, "m", 1e-6, 1.0, "largest distance from a pose goal that counts as arrived"},
      {"rotation", &S::rotation, "rad", 1e-6, 3.0, "largest angle from a pose goal that counts as arrived"},
      {"speed", &S::speed, "rad/s", 1e-6, 100.0, "largest joint speed that counts as arrived"},
  };
  return all;
}

template <>
const std::vector<Field<TrackingSettings>>& fields() {
  using S = TrackingSettings;
  static const std::vector<Field<S>> all{
      {"frequency", &S::frequency, "1/s", 1.0, 300.0,
       "natural frequency of the feedback to the reference: larger is stiffer, but noise and delay can make the arm shake"},
      {"damping", &S::damping, "-", 0.1, 10.0,
       "damping ratio of the feedback: 1 is critical damping; unknown rotor inertias reduce it; lower it if delay or "
       "noise make the arm shake"},
      {"velocity_filter", &S::velocity_filter, "s", 1e-5, 1.0,
       "time constant of the filter that corrects predicted velocities by measured ones: longer is calmer but lags more"},
      {"observer_time", &S::observer_time, "s", 0.005, none,
       "time constant of the disturbance observer (friction, payload, wrong gravity): shorter compensates faster, but "
       "noise and delay can make the arm shake; inf: no observer"},
      {"observer_share", &S::observer_share, "-", 0.0, 1.0,
       "largest torque that the observer compensates, as a share of the effort limits"},
      {"largest_error", &S::largest_error, "rad", 0.001, 10.0,
       "tracking error above which the reference restarts at the arm; for a prismatic joint a fifth of it [m]"},
      {"servo_lag", &S::servo_lag, "rad", 0.001, 10.0,
       "tracking error above which the reference restarts where the arm's own drives track position or velocity"},
      {"stiffness", &S::stiffness, "1/rad", 0.0, 100.0,
       "stiffness of a compliant arm, in effort limits per radian of tracking error: 0.01 is very soft, larger is "
       "stiffer. 0, the default, switches compliance off: the arm is then stiffest"},
      {"drift_gain", &S::drift_gain, "1/s", 0.0, 50.0,
       "gain from position error to commanded velocity, with velocity output: larger returns to the reference faster"},
  };
  return all;
}

template <>
const std::vector<Field<ContactSettings>>& fields() {
  using S = ContactSettings;
  static const std::vector<Field<S>> all{
      {"share", &S::share, "-", 0.02, none,
       "largest torque that neither model, load nor friction explains, as a share of the effort limits: from there on the arm stops "
       "and waits for restart(); smaller feels gentler touches, but untold loads and friction stop the arm too; inf: no stop"},
      {"time", &S::time, "s", 0.0, 1.0, "time for which that torque has to last: longer ignores short knocks"},
  };
  return all;
}

template <>
const std::vector<Field<InputSettings>>& fields() {
  using S = InputSettings;
  static const std::vector<Field<S>> all{
      {"response", &S::response, "1/s", 1.0, 100.0,
       "rate of the response to a commanded velocity or twist: larger responds faster, but passes on more noise"},
      {"timeout", &S::timeout, "s", 0.001, none, "age above which a commanded velocity or twist counts as zero"},
      {"singular", &S::singular, "-", 1e-4, 1.0,
       "smallest singular value of the frame's Jacobian [m and rad] at which a twist keeps its full speed; the arm stops at a fifth of it: "
       "larger is calmer, but stops farther from the stretched arm"},
      {"frequency", &S::frequency, "1/s", 1.0, 50.0,
       "natural frequency of the return to a trajectory or to the planner's path: larger is stiffer"},
      {"lead", &S::lead, "rad", 0.001, 10.0,
       "tracking error above which a trajectory slows down; at twice as much it waits; for a prismatic joint a fifth of "
       "it [m]"},
  };
  return all;
}

template <>
const std::vector<Field<SourceSettings>>& fields() {
  using S = SourceSettings;
  static const std::vector<Field<S>> all{
      {"valid_for", &S::valid_for, "s", 0.01, none,
       "age up to which a source of obstacles is believed that was given a time, has velocities or comes again and again: beyond it the arm stops "
       "until the source comes again; shorter is safer, longer tolerates more lost sets"},
      {"largest_speed", &S::largest_speed, "m/s", 0.0, 100.0,
       "largest speed of obstacles that nobody has told of: larger keeps the arm farther from what is overdue or uncertain"},
      {"empty_after", &S::empty_after, "s", 0.0, none,
       "time for which a source that had obstacles must stay empty before that is believed: longer survives a camera that "
       "sees nothing for longer; remove_obstacles is believed at once"},
  };
  return all;
}

template <>
const std::vector<Field<ControllerSettings>>& fields() {
  using S = ControllerSettings;
  static const std::vector<Field<S>> all{
      {"period", &S::period, "s", 1e-4, 0.1, "time between two calls of step; limits and clearances hold at these samples"},
      {"speed", &S::speed, "-", 0.01, 1.0,
       "share of the velocity and acceleration limits that motions use: less is slower and calmer"},
      {"limit_margin", &S::limit_margin, "-", 0.0, 0.5,
       "share of the limits of velocity, acceleration, jerk and torque rate that stays unused, for noise, delay and "
       "rounding: larger is safer and slower"},
      {"effort_margin", &S::effort_margin, "-", 0.0, 0.5,
       "share of the effort limits that stays unused, for errors of the model: larger is safer and slower"},
      {"position_margin", &S::position_margin, "rad", 0.0, 1.0, "distance by which position limits are moved inwards"},
      {"stop_time", &S::stop_time, "s", 0.005, 10.0, "time constant of the emergency stop: shorter brakes harder"},
      {"stop_damping", &S::stop_damping, "-", 1e-3, 10.0,
       "joint damping of the emergency stop without a mass matrix, in units of effort limit / velocity limit"},
      {"torque_weight", &S::torque_weight, "-", 0.0, 1e3,
       "weight of torque relative to acceleration error: larger saves torque, but the arm sags"},
      {"slack_weight", &S::slack_weight, "-", 1.0, 1e6,
       "weight of exceeding velocity and acceleration limits, relative to acceleration error: larger exceeds them less"},
      {"velocity_overrun", &S::velocity_overrun, "-", 1.0, 10.0,
       "largest velocity that a clearance may demand, as a multiple of the velocity limit"},
      {"acceleration_overrun", &S::acceleration_overrun, "-", 1.0, 100.0,
       "largest acceleration that a clearance may demand, as a multiple of the acceleration limit"},
      {"obstacle_timeout", &S::obstacle_timeout, "s", 0.001, none,
       "age above which every source of obstacles without a valid_for of its own is stale and the arm stops"},
      {"local_activation", &S::local_activation, "-", 0.0, 1.0,
       "shorter activation distances near the goal and in narrow places, among static obstacles; without it the arm "
       "creeps there"},
      {"synchronous", &S::synchronous, "-", 0.0, 1.0,
       "run planner, look-ahead and posture search inside step: motions repeat bit for bit, steps take longer"},
      {"seed", &S::seed, "-", 0.0, most_seed, "seed of all random numbers"},
  };
  return all;
}

void ControllerSettings::validate() const {
  check_fields("controller: ", *this);
  check_fields("controller: barriers.", barriers);
  check_fields("controller: safety.", safety);
  check_fields("controller: arrival.", arrival);
  check_fields("controller: tracking.", tracking);
  check_fields("controller: contact.", contact);
  check_fields("controller: inputs.", inputs);
  check_fields("controller: sources.", sources);
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
