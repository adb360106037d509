#include "sidestep/planning/look_ahead.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <variant>

#include "../math/settings.hpp"
#include "sidestep/clearance/stopping_clearance.hpp"
#include "../attractor/random_configuration.hpp"

namespace sidestep {
namespace {

// How far each joint of a target may be from the arm's [rad | m], in turn; while a trajectory is followed, of every
// other one from its target.
constexpr std::array<double, 3> spreads{0.8, 2.2, 6.3};
constexpr double spread_of_followed = 0.5;  // Spread around the target of the followed trajectory [rad | m].
constexpr double coarse_period = 0.05;      // Time step in which trajectories are compared at first [s].
constexpr double least_steps = 10.0;        // Fewest steps of a coarse motion, if fine ones have as many.
// Clearance below which bodies do not overshoot [m]: the motion is not predicted beyond. Of such motions the longest is the best.
constexpr double touched = -0.02;
// Number of far-reaching references that suffice: others are rejected only while there are more.
constexpr std::size_t enough_references = 10;
// Coarse motions of one look, if each lasts up to the horizon; more if they end before.
constexpr int coarse_horizons = 25;
constexpr std::size_t num_fine = 4;  // Most trajectories that are integrated finely.

const GeometricSystem& checked(const std::shared_ptr<const GeometricSystem>& system) {
  if (system == nullptr) {
    throw std::invalid_argument("look_ahead: there is no system");
  }
  return *system;
}

const LookAheadSettings& validated(const LookAheadSettings& settings) {
  settings.validate();
  return settings;
}

constexpr double rounding = 1e-6;  // Rounding of a quotient of durations.

int whole_periods(double duration, double period) noexcept {
  return std::max(1, static_cast<int>(std::lround(duration / period)));
}

MotionProgramSettings program_settings(double period, bool by_torque) {
  MotionProgramSettings settings;
  settings.period = period;
  settings.by_torque = by_torque;
  return settings;
}

}  // namespace

template <>
const std::vector<Field<LookAheadSettings>>& fields() {
  using S = LookAheadSettings;
  static const std::vector<Field<S>> all{
      {"horizon", &S::horizon, "s", 0.1, 30.0,
       "length of the prediction: longer sees fast obstacles earlier, but takes more processor time"},
      {"period", &S::period, "s", 0.0005, 0.2, "time step of predicted motions: longer is faster to compute and coarser"},
      {"delay", &S::delay, "s", 0.005, 5.0,
       "time from one prediction to the next, and from its start until its result is used"},
      {"clearance", &S::clearance, "m", -0.1, 0.5, "least clearance that a predicted motion must keep from obstacles"},
      {"tries", &S::tries, "-", 1.0, 1e5,
       "number of avoidance trajectories that one prediction tries: more find a way out more often, but take more "
       "processor time"},
      {"slow_after", &S::slow_after, "-", 2.0, 1e3,
       "age of the newest prediction above which the arm slows down near moving obstacles, as a multiple of delay: "
       "smaller is safer where processor time is short"},
      {"rest_after", &S::rest_after, "-", 2.0, 1e4,
       "age of the newest prediction at which the arm stops near moving obstacles, as a multiple of delay"},
  };
  return all;
}

void LookAheadSettings::validate() const {
  check_fields("look_ahead: ", *this);
  require(delay <= horizon, "look_ahead: delay", delay, "no longer than the horizon");
  require(period <= delay, "look_ahead: period", period, "no longer than the delay");
  require(slow_after < rest_after, "look_ahead: slow_after", slow_after, "less than rest_after");
}

double LookAheadSettings::pace(double age) const noexcept {
  return std::clamp((rest_after * delay - age) / ((rest_after - slow_after) * delay), 0.0, 1.0);
}

LookAhead::Stepper::Stepper(const Robot& robot, double period, bool by_torque)
    : period(period), program(robot, program_settings(period, by_torque)) {}

LookAhead::LookAhead(std::shared_ptr<const GeometricSystem> system, LookAheadSettings settings,
                     std::optional<RigidBodyDynamics> dynamics)
    : system_(std::move(system)),
      settings_(validated(settings)),
      workspace_(checked(system_)),
      periods_(static_cast<int>(std::ceil(settings.delay / settings.period - rounding))),
      dynamics_(std::move(dynamics)),
      mass_(num_coordinates(), num_coordinates()),
      bias_(num_coordinates()),
      fine_(system_->robot(), settings.delay / periods_, dynamics_.has_value()),
      coarse_(system_->robot(), std::max(fine_.period, std::min(coarse_period, settings.horizon / least_steps)),
              dynamics_.has_value()),
      filtered_(num_coordinates()),
      random_(settings.seed) {
  if (dynamics_) {
    if (!dynamics_->robot().same_joints(system_->robot())) {
      throw std::invalid_argument("look_ahead: the dynamics are of another robot");
    }
    dynamics_workspace_.emplace(*dynamics_);
  }
  for (std::size_t k = 0; k < system_->labels().size(); ++k) {
    if (system_->labels()[k].kind == CoordinateLabel::Kind::obstacle) {
      of_obstacles_.push_back(static_cast<Eigen::Index>(k));
    }
  }
  if (of_obstacles_.empty()) {
    throw std::invalid_argument("look_ahead: the system has no clearances to obstacles (ClearanceBarrier)");
  }
}

std::optional<AvoidanceTrajectory> LookAhead::update(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                                     const Obstacles& obstacles,
                                                     const std::optional<AvoidanceTrajectory>& followed, const Leader& leader) {
  const auto usable = [this](const Eigen::VectorXd& x) { return x.size() == num_coordinates() && x.allFinite(); };
  if (!obstacles.tree().moves() || !usable(q) || !usable(v)) {
    return std::nullopt;
  }
  Motion now{q, v, obstacles, goal, leader, followed};
  for (int k = 0; k < periods_; ++k) {
    advance(now, fine_);
  }
  std::optional<AvoidanceTrajectory> best_flight = std::exchange(now.flight, std::nullopt);
  const auto is_free = [this](double clearance) { return clearance >= settings_.clearance; };
  const auto clearance_of = [&](const std::optional<AvoidanceTrajectory>& flight, double enough) {
    return least_clearance({now.q, now.v, now.obstacles, now.goal, now.leader, flight}, fine_, enough);
  };
  double best = clearance_of(std::nullopt, -infinity);
  if (is_free(best)) {
    return std::nullopt;
  }
  if (best_flight) {
    const double kept = clearance_of(best_flight, best);
    if (!(kept > best)) {
      best_flight.reset();
    }
    best = std::max(best, kept);
  }
  if (is_free(best)) {
    return best_flight;
  }
  bool found = false;
  for (const Tried& tried : promising(now, best_flight)) {
    const double clearance = clearance_of(tried.flight, best);
    if (clearance > best) {
      best = clearance;
      best_flight = tried.flight;
      found = true;
    }
    if (is_free(best)) {
      break;
    }
  }
  count_ += found;
  return best_flight;
}

const AvoidanceTrajectory* LookAhead::pursue(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                             const Obstacles& obstacles, double period, const Leader& leader) {
  // Less than half a period too early, so that sums of periods may be rounded. Written so that a period that is not a
  // number makes it look.
  if (is_due(period)) {
    std::optional<AvoidanceTrajectory> next = update(goal, q, v, obstacles, found_, leader);
    until_look_ = std::max(until_look_ + settings_.delay, 0.0);
    pursued_ = std::exchange(found_, std::move(next));
  } else if (pursued_) {
    pursued_->advance(period);
  }
  until_look_ -= period;
  return pursued_ ? &*pursued_ : nullptr;
}

void LookAhead::reset() noexcept {
  found_.reset();
  pursued_.reset();
  until_look_ = 0.0;
}

void LookAhead::check_interrupted() const {
  if (interrupted_()) {
    throw Interruption();
  }
}

double LookAhead::advance(Motion& motion, Stepper& stepper) {
  check_interrupted();
  const double period = stepper.period;
  workspace_.horizon = motion.flight ? 0.0 : Horizon::of_obstacles;
  bool sees;
  Eigen::VectorXd wanted;
  if (motion.flight) {
    sees = system_->embed(motion.q, motion.v, motion.obstacles, workspace_);
    wanted = motion.flight->acceleration(motion.q, motion.v, period);
    motion.flight->advance(period);
  } else {
    const StepStatus status = system_->acceleration(motion.q, motion.v, motion.goal, motion.obstacles, workspace_);
    sees = !is_fallback(status);
    wanted = workspace_.acceleration;
  }
  ++stepper.steps;
  double clearance = sees ? infinity : -infinity;
  for (const Eigen::Index k : of_obstacles_) {
    clearance = std::min(clearance, workspace_.clearances.values[k]);
  }
  const Clearances* clearances = sees ? &workspace_.clearances : nullptr;
  if (stepper.program.settings().by_torque) {
    dynamics_->mass_matrix(motion.q, *dynamics_workspace_, mass_);
    dynamics_->bias(motion.q, motion.v, *dynamics_workspace_, bias_);
  }
  static_cast<void>(stepper.program.solve({motion.q, motion.v, wanted, mass_, bias_, clearances}, filtered_));
  motion.v += period * filtered_.acceleration;
  motion.q += period * motion.v;
  motion.obstacles.advance(period);
  if (motion.leader) {
    motion.leader(motion.q, motion.v, period, motion.goal);
  } else {
    sidestep::advance(motion.goal, period);
  }
  return clearance;
}

double LookAhead::least_clearance(Motion motion, Stepper& stepper, double enough) {
  double least = infinity;
  for (int k = 0; k < whole_periods(settings_.horizon, stepper.period) && least > enough; ++k) {
    least = std::min(least, advance(motion, stepper));
    if (least < touched) {
      return touched - (settings_.horizon - k * stepper.period);
    }
  }
  return least;
}

std::vector<AvoidanceTrajectory> LookAhead::draw_flights(const Motion& now,
                                                         const std::optional<AvoidanceTrajectory>& followed) {
  struct Reference {
    AvoidanceTrajectory flight, moved;
    int free = 0;  // Steps without contact.
  };
  std::vector<Reference> references;
  references.reserve(static_cast<std::size_t>(settings_.tries));
  for (int number = 0; number < settings_.tries; ++number) {
    check_interrupted();
    const double spread = spreads[static_cast<std::size_t>(number / 2) % spreads.size()];
    Eigen::VectorXd target = number % 2 == 1 && followed ? draw(followed->target(), spread_of_followed) : draw(now.q, spread);
    const AvoidanceTrajectory flight(system_->robot().limits(), now.q, now.v, std::move(target));
    references.push_back({flight, flight});
  }
  Obstacles obstacles = now.obstacles;
  std::size_t left = references.size();
  for (int k = 0; k < whole_periods(settings_.horizon, coarse_.period) && left > enough_references; ++k) {
    for (Reference& reference : references) {
      if (reference.free < k) {
        continue;
      }
      check_interrupted();
      if (system_->touches(reference.moved.position(), obstacles, -touched, workspace_)) {
        --left;
        continue;
      }
      reference.moved.advance(coarse_.period);
      reference.free = k + 1;
    }
    obstacles.advance(coarse_.period);
  }
  std::stable_sort(references.begin(), references.end(),
                   [](const Reference& a, const Reference& b) { return a.free > b.free; });
  std::vector<AvoidanceTrajectory> flights;
  for (Reference& reference : references) {
    flights.push_back(std::move(reference.flight));
  }
  return flights;
}

std::vector<LookAhead::Tried> LookAhead::promising(const Motion& now, const std::optional<AvoidanceTrajectory>& followed) {
  const int most_steps = coarse_horizons * whole_periods(settings_.horizon, coarse_.period);
  const double ample = 2.0 * settings_.clearance;
  std::vector<Tried> best;
  coarse_.steps = 0;
  for (AvoidanceTrajectory& flight : draw_flights(now, followed)) {
    const bool full = best.size() == num_fine;
    if (coarse_.steps >= most_steps || (full && best.back().clearance >= ample)) {
      break;
    }
    const double enough = full ? best.back().clearance : -infinity;
    const double clearance = least_clearance({now.q, now.v, now.obstacles, now.goal, now.leader, flight}, coarse_, enough);
    if (full && !(clearance > best.back().clearance)) {
      continue;
    }
    if (full) {
      best.pop_back();
    }
    const auto at = std::upper_bound(best.begin(), best.end(), clearance,
                                     [](double value, const Tried& tried) { return value > tried.clearance; });
    best.insert(at, {clearance, std::move(flight)});
  }
  return best;
}

Eigen::VectorXd LookAhead::draw(const Eigen::VectorXd& q, double spread) {
  const JointLimits& limits = system_->robot().limits();
  Eigen::VectorXd target(num_coordinates());
  random_configuration(random_, limits.lower, limits.upper, q, spread, target);
  return target;
}

}  // namespace sidestep
