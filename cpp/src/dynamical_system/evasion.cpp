#include "sidestep/dynamical_system/evasion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "../settings.hpp"
#include "random_configuration.hpp"

namespace sidestep {
namespace {

// How far each joint of a refuge may be from the arm's [rad | m], in turn; every other one from that of the flight found.
constexpr std::array<double, 3> spreads{0.8, 1.7, 3.1};
constexpr double spread_of_found = 0.5;
constexpr double reference_period = 0.05;  // [s] between the configurations of a reference that are looked at
constexpr std::size_t num_motions = 8;     // flights that are integrated in one look, at most

const GeometricSystem& checked(const std::shared_ptr<const GeometricSystem>& system) {
  if (system == nullptr) {
    throw std::invalid_argument("evasion: there is no system");
  }
  return *system;
}

const EvasionSettings& validated(const EvasionSettings& settings) {
  settings.validate();
  return settings;
}

constexpr double most_periods = 1e5;

int whole_periods(double duration, double period) noexcept {
  return std::max(1, static_cast<int>(std::lround(duration / period)));
}

AccelerationFilterSettings filter_settings(double period) {
  AccelerationFilterSettings settings;
  settings.period = period;
  return settings;
}

}  // namespace

void EvasionSettings::validate() const {
  const auto finite = [](double value, const char* name) {
    require(value > 0.0 && std::isfinite(value), name, value, "positive and finite");
  };
  finite(horizon, "evasion: horizon");
  finite(period, "evasion: period");
  finite(delay, "evasion: delay");
  require(delay <= horizon, "evasion: delay", delay, "no longer than the horizon");
  require(period <= delay, "evasion: period", period, "no longer than the delay");
  require(horizon <= most_periods * period, "evasion: horizon", horizon, "at most 100,000 periods");
  require(std::isfinite(clearance), "evasion: clearance", clearance, "finite");
  require(tries >= 1, "evasion: tries", tries, ">= 1");
}

Evasion::Evasion(std::shared_ptr<const GeometricSystem> system, EvasionSettings settings)
    : system_(std::move(system)),
      settings_(validated(settings)),
      workspace_(checked(system_)),
      filter_(system_->robot(), filter_settings(settings.period)),
      filtered_(num_coordinates()),
      random_(settings.seed) {
  for (std::size_t k = 0; k < system_->labels().size(); ++k) {
    if (system_->labels()[k].kind == CoordinateLabel::Kind::obstacle) {
      of_obstacles_.push_back(static_cast<Eigen::Index>(k));
    }
  }
  if (of_obstacles_.empty()) {
    throw std::invalid_argument("evasion: the system has no clearances to obstacles (ClearanceBarrier)");
  }
}

const std::optional<Flight>& Evasion::look(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                           const Obstacles& obstacles) {
  const auto usable = [this](const Eigen::VectorXd& x) { return x.size() == num_coordinates() && x.allFinite(); };
  if (!obstacles.tree().moves() || !usable(q) || !usable(v)) {
    found_.reset();
    return found_;
  }
  // Until then what was found before is followed.
  Motion now{q, v, obstacles, goal, found_};
  for (int k = 0; k < whole_periods(settings_.delay, settings_.period); ++k) {
    advance(now);
  }
  const auto is_free = [this](double clearance) { return clearance >= settings_.clearance; };
  found_ = std::exchange(now.flight, std::nullopt);
  double best = least_clearance(now, -infinity);
  if (is_free(best)) {
    found_.reset();
    return found_;
  }
  if (found_) {
    const double kept = least_clearance({now.q, now.v, now.obstacles, now.goal, found_}, best);
    if (kept > best) {
      best = kept;
    } else {
      found_.reset();
    }
  }
  if (is_free(best)) {
    return found_;
  }
  bool found = false;
  for (const Tried& tried : promising(now)) {
    const double clearance = least_clearance({now.q, now.v, now.obstacles, now.goal, tried.flight}, best);
    if (clearance > best) {
      best = clearance;
      found_ = tried.flight;
      found = true;
    }
    if (is_free(best)) {
      break;
    }
  }
  count_ += found;
  return found_;
}

const Flight* Evasion::pursue(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                              const Obstacles& obstacles, double period) {
  // Less than half a period too early, so that sums of periods may be rounded. Written so that a period that is not a
  // number makes it look.
  if (!(until_look_ > 0.5 * period)) {
    until_look_ = settings_.delay;
    pursued_ = found_;
    look(goal, q, v, obstacles);
  } else if (pursued_) {
    pursued_->advance(period);
  }
  until_look_ -= period;
  return pursued_ ? &*pursued_ : nullptr;
}

double Evasion::obstacle_clearance() const noexcept {
  double least = infinity;
  for (const Eigen::Index k : of_obstacles_) {
    least = std::min(least, workspace_.clearances.values[k]);
  }
  return least;
}

double Evasion::advance(Motion& motion) {
  StepStatus status = system_->acceleration(motion.q, motion.v, motion.goal, motion.obstacles, workspace_);
  if (is_fallback(status)) {  // it brakes, and stays
    const JointLimits& limits = system_->robot().limits();
    motion.goal = JointGoal(motion.q.cwiseMax(limits.lower).cwiseMin(limits.upper));
    status = system_->acceleration(motion.q, motion.v, motion.goal, motion.obstacles, workspace_);
  }
  const bool known = !is_fallback(status);
  const double clearance = known ? obstacle_clearance() : -infinity;
  if (motion.flight) {
    workspace_.acceleration = motion.flight->acceleration(motion.q, motion.v);
    motion.flight->advance(settings_.period);
  }
  const Clearances* clearances = known ? &workspace_.clearances : nullptr;
  static_cast<void>(filter_.apply(motion.q, motion.v, workspace_.acceleration, clearances, filtered_));
  motion.v += settings_.period * filtered_.acceleration;
  motion.q += settings_.period * motion.v;
  motion.obstacles.advance(settings_.period);
  sidestep::advance(motion.goal, settings_.period);
  return clearance;
}

double Evasion::least_clearance(Motion motion, double enough) {
  double least = infinity;
  for (int k = 0; k < whole_periods(settings_.horizon, settings_.period) && least > enough; ++k) {
    least = std::min(least, advance(motion));
  }
  return least;
}

double Evasion::reference_clearance(Flight flight, Obstacles obstacles, double enough) {
  const Eigen::VectorXd at_rest = Eigen::VectorXd::Zero(num_coordinates());
  double least = infinity;
  for (int k = 0; k < whole_periods(settings_.horizon, reference_period) && least > enough; ++k) {
    const JointGoal here(flight.position());
    const StepStatus status = system_->acceleration(here.position, at_rest, here, obstacles, workspace_);
    least = is_fallback(status) ? -infinity : std::min(least, obstacle_clearance());
    flight.advance(reference_period);
    obstacles.advance(reference_period);
  }
  return least;
}

std::vector<Evasion::Tried> Evasion::promising(const Motion& now) {
  const JointLimits& limits = system_->robot().limits();
  std::vector<Tried> best;
  for (int number = 0; number < settings_.tries; ++number) {
    const Flight flight(limits, now.q, now.v, draw(now.q, number), settings_.period);
    const bool full = best.size() == num_motions;
    const double clearance = reference_clearance(flight, now.obstacles, full ? best.back().clearance : -infinity);
    if (full && !(clearance > best.back().clearance)) {
      continue;
    }
    if (full) {
      best.pop_back();
    }
    const auto at = std::upper_bound(best.begin(), best.end(), clearance,
                                     [](double value, const Tried& tried) { return value > tried.clearance; });
    best.insert(at, {clearance, flight});
  }
  return best;
}

Eigen::VectorXd Evasion::draw(const Eigen::VectorXd& q, int number) {
  const JointLimits& limits = system_->robot().limits();
  Eigen::VectorXd refuge(num_coordinates());
  if (number % 2 == 1 && found_) {
    random_configuration(random_, limits.lower, limits.upper, found_->refuge(), spread_of_found, refuge);
  } else {
    const double spread = spreads[static_cast<std::size_t>(number / 2) % spreads.size()];
    random_configuration(random_, limits.lower, limits.upper, q, spread, refuge);
  }
  return refuge;
}

}  // namespace sidestep
