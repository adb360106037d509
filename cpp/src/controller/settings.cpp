#include "sidestep/controller/settings.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace sidestep {
namespace {

constexpr double none = std::numeric_limits<double>::infinity();  // no bound
constexpr double tiny = 1e-9;                                     // stands for "positive"
constexpr double most_seed = 1.8446744073709552e19;

std::string written(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

template <class Settings>
void check(const char* group, const Settings& settings) {
  for (const Field<Settings>& field : fields<Settings>()) {
    const double value = value_of(field, settings);
    if (!(value >= field.least && value <= field.most)) {
      const std::string unit = std::string(field.unit) == "-" ? "" : std::string(" ") + field.unit;
      throw std::invalid_argument(std::string(group) + field.name + " is " + written(value) + unit + ", allowed: " +
                                  written(field.least) + " to " + written(field.most) + unit);
    }
  }
}

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
      {"temperature", &S::temperature, "m", 1e-4, 0.02, "smoothing over points and ellipsoids: larger is smoother and less exact"},
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
const std::vector<Field<SafetySettings>>& fields() {
  using S = SafetySettings;
  static const std::vector<Field<S>> all{
      {"margin", &S::margin, "m", 0.0, 0.5, "clearance that every command keeps: covers tracking error, delay and noise of points"},
      {"rate", &S::rate, "1/s", 0.5, 200.0, "how quickly a clearance may close on its margin: larger comes close quicker"},
      {"braking_fraction", &S::braking_fraction, "-", 0.05, 1.0, "share of the hardest deceleration that is counted on"},
      {"correction", &S::correction, "-", 0.01, 1.0, "share of an excess of closing speed that one period takes away"},
      {"max_rows", &S::max_rows, "-", 1.0, 256.0, "clearances that bound one command: the most critical ones"},
  };
  return all;
}

template <>
const std::vector<Field<PlannerSettings>>& fields() {
  using S = PlannerSettings;
  static const std::vector<Field<S>> all{
      {"margin", &S::margin, "m", 0.001, 0.5, "clearance of a wide way, which is preferred"},
      {"floor", &S::floor, "m", 1e-4, 0.5, "clearance that every way keeps: smaller finds narrower ways"},
      {"allowance", &S::allowance, "m", 0.0, 0.2, "how deep an ellipsoid may be in something at start or goal"},
      {"pair_allowance", &S::pair_allowance, "m", 0.0, 0.2, "the same of two links below their contact"},
      {"slack", &S::slack, "m", 1e-5, 0.1, "what an edge may come nearer than its margin: larger is quicker"},
      {"fade", &S::fade, "m", 0.01, 10.0, "way on which what an end may come nearer fades"},
      {"range", &S::range, "rad", 0.01, 10.0, "longest edge of the search trees"},
      {"max_nodes", &S::max_nodes, "-", 2.0, 1e7, "of both trees: the budget of a search"},
      {"max_iterations", &S::max_iterations, "-", 1.0, 1e8, "of a search: its budget"},
      {"max_seconds", &S::max_seconds, "s", tiny, none, "of a search; motions then do not repeat"},
      {"shortcuts", &S::shortcuts, "-", 0.0, 1e5, "attempts to shorten a path: more are shorter and later"},
  };
  return all;
}

template <>
const std::vector<Field<RouteSettings>>& fields() {
  using S = RouteSettings;
  static const std::vector<Field<S>> all{
      {"speed", &S::speed, "rad/s", 0.01, 20.0, "largest speed of the reference along the path"},
      {"speed_share", &S::speed_share, "-", 0.01, 1.0, "of the joints' velocity limits that the reference may ask for"},
      {"acceleration", &S::acceleration, "rad/s^2", 0.01, 100.0, "at which the reference slows down ahead"},
      {"wide", &S::wide, "m", 0.001, 1.0, "clearance from which the reference goes at full speed"},
      {"slowest", &S::slowest, "-", 0.01, 1.0, "share of the speed that is left where there is no clearance"},
      {"lead", &S::lead, "rad", 0.01, 3.0, "distance at which the reference waits for the arm: larger is faster and cuts corners"},
      {"delay", &S::delay, "s", 0.001, 3.0, "by which the arm follows a corner; 1 / (e sqrt(stiffness)) of a critical spring"},
  };
  return all;
}

template <>
const std::vector<Field<OnlinePlannerSettings>>& fields() {
  using S = OnlinePlannerSettings;
  static const std::vector<Field<S>> all{
      {"period", &S::period, "s", 0.001, 10.0, "between two looks of the planner at the scene: shorter reacts earlier"},
      {"patience", &S::patience, "s", 0.05, 60.0, "without progress until another path is looked for"},
      {"retry", &S::retry, "s", 0.05, 600.0, "until a failed search is repeated in the same scene"},
  };
  return all;
}

template <>
const std::vector<Field<EvasionSettings>>& fields() {
  using S = EvasionSettings;
  static const std::vector<Field<S>> all{
      {"horizon", &S::horizon, "s", 0.1, 30.0, "how far is looked ahead: longer sees what is fast, and takes more time"},
      {"period", &S::period, "s", 0.0005, 0.2, "of the steps of predicted motions: longer is quicker and coarser"},
      {"delay", &S::delay, "s", 0.005, 5.0, "from one look to the next, from when on what it found is followed"},
      {"clearance", &S::clearance, "m", -0.1, 0.5, "that a predicted motion has to keep from obstacles"},
      {"tries", &S::tries, "-", 1.0, 1e5, "trajectories that are drawn in one look"},
  };
  return all;
}

template <>
const std::vector<Field<EscapeSettings>>& fields() {
  using S = EscapeSettings;
  static const std::vector<Field<S>> all{
      {"patience", &S::patience, "s", 0.05, 60.0, "without progress until a sub-goal is taken"},
      {"fraction", &S::fraction, "-", 1e-4, 0.99, "progress is a squared distance to the goal that falls by this share"},
      {"leg", &S::leg, "s", 0.1, 60.0, "longest way to the first sub-goal; n times that to the n-th"},
      {"spread", &S::spread, "rad", 0.01, 20.0, "how far each joint of the first sub-goal may be; n times that of the n-th"},
  };
  return all;
}

template <>
const std::vector<Field<ControllerSettings>>& fields() {
  using S = ControllerSettings;
  static const std::vector<Field<S>> all{
      {"period", &S::period, "s", 1e-4, 0.1, "between two calls of step; limits and clearances hold at samples so far apart"},
      {"position_margin", &S::position_margin, "rad", 0.0, 1.0, "by which position limits are moved inwards"},
      {"stop_time", &S::stop_time, "s", 0.005, 10.0, "time constant of the damped stop"},
      {"stop_damping", &S::stop_damping, "-", 1e-3, 10.0,
       "of a stop where the mass matrix is unusable, as a share of effort limit / velocity limit"},
      {"torque_weight", &S::torque_weight, "-", 0.0, 1e3, "price of torque against tracking: larger saves torque and sags"},
      {"slack_weight", &S::slack_weight, "-", 1.0, 1e6, "price of leaving velocity and acceleration limits against tracking"},
      {"safety_weight", &S::safety_weight, "-", 1.0, 1e6, "price of leaving clearances against that of other limits"},
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
  check("controller: ", *this);
  check("controller: barriers.", barriers);
  check("controller: safety.", safety);
  check("controller: arrival.", arrival);
  if (!(barriers.floor < barriers.activation && barriers.floor < barriers.self_activation)) {
    throw std::invalid_argument("controller: barriers.floor is " + written(barriers.floor) +
                                " m, allowed: below barriers.activation and barriers.self_activation");
  }
  if (planner) {
    check("controller: planner.", *planner);
    check("controller: planner.search.", planner->search);
    check("controller: planner.route.", planner->route);
    planner->search.validate();
    planner->route.validate();
  }
  if (look_ahead) {
    check("controller: look_ahead.", *look_ahead);
    look_ahead->validate();
  }
  if (local_minimum) {
    check("controller: local_minimum.", *local_minimum);
  }
  safety.validate();
}

}  // namespace sidestep
