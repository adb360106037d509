#include "sidestep/dynamical_system/evasion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "../settings.hpp"
#include "random_configuration.hpp"

namespace sidestep {
namespace {

// How far each joint of a sub-goal may be from the arm's [rad | m], in turn; every fourth from that of the best so far.
constexpr std::array<double, 3> spreads{0.8, 1.7, 3.1};
constexpr double spread_of_best = 0.5;

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
      random_(settings.seed),
      sub_goal_(JointGoal(Eigen::VectorXd::Zero(num_coordinates()))),
      pursued_(sub_goal_) {
  for (std::size_t k = 0; k < system_->labels().size(); ++k) {
    if (system_->labels()[k].kind == CoordinateLabel::Kind::obstacle) {
      of_obstacles_.push_back(static_cast<Eigen::Index>(k));
    }
  }
  if (of_obstacles_.empty()) {
    throw std::invalid_argument("evasion: the system has no clearances to obstacles (ClearanceBarrier)");
  }
}

void Evasion::look(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Obstacles& obstacles) {
  const auto usable = [this](const Eigen::VectorXd& x) { return x.size() == num_coordinates() && x.allFinite(); };
  if (!obstacles.tree().moves() || !usable(q) || !usable(v)) {
    evading_ = false;
    return;
  }
  // Until then what was found before is followed.
  State start{q, v, following(goal), obstacles};
  for (int k = 0; k < whole_periods(settings_.delay, settings_.period); ++k) {
    advance(start);
  }
  const auto is_free = [this](double clearance) { return clearance >= settings_.clearance; };
  double best = least_clearance(start, goal, -std::numeric_limits<double>::infinity());
  if (is_free(best)) {
    evading_ = false;
    return;
  }
  if (evading_) {
    const double kept = least_clearance(start, sub_goal_, best);
    evading_ = kept > best;
    best = std::max(best, kept);
  }
  bool found = false;
  for (int number = 0; number < settings_.tries && !is_free(best); ++number) {
    Goal candidate = draw(start.q, number);
    const double clearance = least_clearance(start, candidate, best);
    if (clearance > best) {
      best = clearance;
      sub_goal_ = std::move(candidate);
      evading_ = found = true;
    }
  }
  count_ += found;
}

const Goal& Evasion::pursue(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                            const Obstacles& obstacles, double period) {
  // Less than half a period too early, so that sums of periods may be rounded. Written so that a period that is not a
  // number makes it look.
  if (!(until_look_ > 0.5 * period)) {
    until_look_ = settings_.delay;
    pursuing_ = evading_;
    pursued_ = sub_goal_;
    look(goal, q, v, obstacles);
  }
  until_look_ -= period;
  return pursuing_ ? pursued_ : goal;
}

double Evasion::advance(State& state) {
  StepStatus status = system_->acceleration(state.q, state.v, state.goal, state.obstacles, workspace_);
  if (is_fallback(status)) {  // it brakes, and stays
    const JointLimits& limits = system_->robot().limits();
    state.goal = JointGoal(state.q.cwiseMax(limits.lower).cwiseMin(limits.upper));
    status = system_->acceleration(state.q, state.v, state.goal, state.obstacles, workspace_);
  }
  double least = -std::numeric_limits<double>::infinity();
  if (!is_fallback(status)) {
    least = -least;
    for (const Eigen::Index k : of_obstacles_) {
      least = std::min(least, workspace_.clearances.values[k]);
    }
  }
  const Clearances* clearances = is_fallback(status) ? nullptr : &workspace_.clearances;
  static_cast<void>(filter_.apply(state.q, state.v, workspace_.acceleration, clearances, filtered_));
  state.v += settings_.period * filtered_.acceleration;
  state.q += settings_.period * state.v;
  state.obstacles.advance(settings_.period);
  sidestep::advance(state.goal, settings_.period);
  return least;
}

double Evasion::least_clearance(const State& start, const Goal& goal, double enough) {
  State state{start.q, start.v, goal, start.obstacles};
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < whole_periods(settings_.horizon, settings_.period) && least > enough; ++k) {
    least = std::min(least, advance(state));
  }
  return least;
}

Goal Evasion::draw(const Eigen::VectorXd& q, int number) {
  JointGoal goal(q);
  const JointLimits& limits = system_->robot().limits();
  const std::size_t turn = static_cast<std::size_t>(number) % (spreads.size() + 1);
  if (turn < spreads.size() || !evading_) {
    random_configuration(random_, limits.lower, limits.upper, q, spreads[turn % spreads.size()], goal.position);
  } else {
    random_configuration(random_, limits.lower, limits.upper, std::get<JointGoal>(sub_goal_).position, spread_of_best,
                         goal.position);
  }
  return goal;
}

}  // namespace sidestep
