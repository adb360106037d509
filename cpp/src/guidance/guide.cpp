#include "sidestep/guidance/guide.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr double widening = 1.5;   // the margin grows by this factor each time the arm was stuck
constexpr int widenings = 4;    // and begins anew after so many
constexpr double back = 0.05;   // between places behind the attractor where an arm may find back to its path [rad]

}  // namespace

const char* name(GuideStatus status) noexcept {
  switch (status) {
    case GuideStatus::idle: return "idle";
    case GuideStatus::moving: return "moving";
    case GuideStatus::arrived: return "arrived";
    case GuideStatus::no_path: return "no_path";
    case GuideStatus::goal_in_collision: return "goal_in_collision";
    case GuideStatus::start_in_collision: return "start_in_collision";
    case GuideStatus::timeout: return "timeout";
    case GuideStatus::invalid: return "invalid";
  }
  return "unknown";
}

void GuideSettings::validate() const {
  planner.validate();
  route.validate();
  const auto positive = [](double value, const char* what) {
    require(value > 0.0, what, value, "positive");
  };
  positive(period, "guide: period");
  positive(patience, "guide: patience");
  positive(retry, "guide: retry");
  positive(tolerance, "guide: tolerance");
  positive(duration, "guide: duration");
}

Guide::Guide(BodyClearance body, const GuideSettings& settings)
    : body_(std::move(body)),
      settings_((settings.validate(), settings)),
      goal_(Eigen::VectorXd::Zero(body_.robot().num_coordinates())),
      last_q_(goal_),
      velocity_(goal_),
      progress_(settings.patience),
      states_(State{goal_, goal_}),
      answers_(Answer{}),
      newest_(std::make_shared<const Obstacles>(Obstacles::none())),
      planner_(body_, settings.planner),
      obstacles_(newest_),
      margin_(settings.planner.margin) {
  if (!settings_.synchronous) {
    planner_.interrupt_when([this] {
      newer_ = states_.update() || newer_;
      return stopping_.load() || states_.get().goal_number != seen_goal_;
    });
    thread_ = std::thread([this] { run(); });
  }
}

Guide::~Guide() {
  stopping_.store(true);
  wake_.release();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Guide::set_goal(const Eigen::VectorXd& goal) {
  if (goal.size() != goal_.size() || !goal.allFinite()) {
    throw std::invalid_argument("guide: the goal has " + std::to_string(goal.size()) + " entries, " +
                                std::to_string(goal_.size()) + " finite ones are needed");
  }
  goal_ = goal;
  ++goal_number_;
  started_ = false;
  stops_ = 0;
  progress_.reset();
}

void Guide::set_obstacles(const Obstacles& obstacles) {
  const auto same = [&](const Obstacles& o) {
    return o.size() == obstacles.size() && o.points() == obstacles.points() && o.radii() == obstacles.radii();
  };
  auto copy = std::make_shared<const Obstacles>(obstacles);
  const std::lock_guard lock(mutex_);
  if (same(*newest_)) {
    return;
  }
  newest_.swap(copy);
  ++scene_number_;
}

GuideStatus Guide::step(Eigen::Ref<const Eigen::VectorXd> q, double time, Attractor& attractor) noexcept {
  attractor.velocity.setZero(goal_.size());
  attractor.acceleration.setZero(goal_.size());
  attractor.places.col(0) = goal_;
  attractor.num_places = 1;
  attractor.arrives = false;
  if (goal_number_ == 0 || q.size() != goal_.size() || !q.allFinite()) {
    attractor.position = goal_;
    if (q.size() == goal_.size()) {
      attractor.position = q;
    }
    return goal_number_ == 0 ? GuideStatus::idle : GuideStatus::invalid;
  }
  const bool first = !started_;
  if (first) {
    started_ = true;
    begin_ = last_time_ = next_look_ = time;
    last_q_ = q;
    velocity_.setZero();
  } else if (time > last_time_) {
    velocity_ = (q - last_q_) / (time - last_time_);
    last_q_ = q;
  }
  // Tell the guide; in a thread it looks at its own pace, and at once at a new goal.
  if (!settings_.synchronous || time >= next_look_) {
    State& state = states_.draft();
    state.q = q;
    state.goal = goal_;
    state.time = time;
    state.station = follower_.station;
    state.goal_number = goal_number_;
    state.route_number = followed_;
    state.stops = stops_;
    states_.submit();
    if (settings_.synchronous) {
      next_look_ = time + settings_.period;
      look(states_.get());
    } else if (first) {
      wake_.release();
    }
  }

  const Answer& answer = answers_.get();
  const bool ours = answer.goal_number == goal_number_;
  if (ours && answer.status == PlanStatus::found && !answer.direct) {
    if (answer.route_number != followed_) {
      followed_ = answer.route_number;
      follower_.enter(answer.route, q, velocity_);
    }
    attractor.position.resize(goal_.size());
    follower_.advance(answer.route, settings_.route, q, time - last_time_, attractor.position, attractor.velocity,
                      attractor.acceleration);
    if (const Eigen::Index num = follower_.narrow(answer.route, settings_.route, attractor.places); num > 0) {
      attractor.num_places = num;
      attractor.arrives = answer.route.length() - follower_.station <= settings_.route.lead;
    }
  } else {
    attractor.position = goal_;
    follower_.rate = 0.0;
  }
  last_time_ = time;

  if ((q - goal_).cwiseAbs().maxCoeff() < settings_.tolerance) {
    progress_.reset();
    return GuideStatus::arrived;
  }
  const double left = ours && !answer.direct ? answer.route.length() - follower_.station : 0.0;
  const double away = (attractor.position - q).norm() + left;
  if (ours && answer.path_number != measured_) {  // another way may be longer
    measured_ = answer.path_number;
    progress_.reset();
  }
  if (progress_.update(time, std::exp(away))) {  // it goes with what is left, however long the way
    ++stops_;
    progress_.reset();
  }
  if (ours) {
    switch (answer.status) {
      case PlanStatus::start_in_collision: return GuideStatus::start_in_collision;
      case PlanStatus::goal_in_collision: return GuideStatus::goal_in_collision;
      case PlanStatus::invalid: return GuideStatus::invalid;
      case PlanStatus::no_path:
      case PlanStatus::timeout:
        if (!answer.direct) {
          return GuideStatus::no_path;
        }
        break;
      case PlanStatus::found: break;
    }
  }
  return time - begin_ > settings_.duration ? GuideStatus::timeout : GuideStatus::moving;
}

Plan Guide::last_plan() const {
  const std::lock_guard lock(mutex_);
  return shown_;
}

Guide::Counts Guide::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void Guide::run() {
  while (!stopping_.load()) {
    static_cast<void>(wake_.try_acquire_for(std::chrono::duration<double>(settings_.period)));
    if ((states_.update() || newer_) && !stopping_.load()) {
      newer_ = false;
      look(State(states_.get()));  // a copy: newer ones come while it looks
    }
  }
}

void Guide::look(const State& state) {
  if (state.goal_number == 0) {
    return;
  }
  bool changed = false;
  {
    const std::lock_guard lock(mutex_);
    if (scene_number_ != seen_scene_) {
      obstacles_ = newest_;
      seen_scene_ = scene_number_;
      changed = true;
    }
  }
  const Obstacles& obstacles = *obstacles_;
  const bool new_goal = state.goal_number != seen_goal_;
  if (new_goal) {
    seen_goal_ = state.goal_number;
    seen_stops_ = state.stops;
    have_path_ = direct_ = failed_ = false;
    margin_ = settings_.planner.margin;
  }
  bool stuck = false;
  if (state.stops != seen_stops_) {
    seen_stops_ = state.stops;
    stuck = true;
    margin_ = settings_.planner.margin * std::pow(widening, static_cast<double>(state.stops % widenings));
  }
  // Straight to the goal where that is free with the margin; not where the arm was stuck, which needs another way.
  // To let go of a path it must be wide, as barriers may stop what goes straight through a narrow place.
  const PlannerSettings& asked = settings_.planner;
  const double wide = have_path_ ? asked.margin : std::sqrt(asked.margin * asked.floor);
  const bool straight = state.stops == 0 && !stuck &&
                        planner_.sees(state.q, state.goal, wide, obstacles);
  if (straight) {
    Obstruction found;
    if (!planner_.obstructed(state.goal, obstacles, found) && !planner_.obstructed(state.q, obstacles, found)) {
      if (!direct_ || new_goal || status_ != PlanStatus::found) {
        direct_ = true;
        have_path_ = failed_ = false;
        ++path_number_;
        answer(state, PlanStatus::found, true);
      }
      return;
    }
  }
  if (have_path_ && !stuck && !direct_) {
    const bool follows = state.route_number == route_number_;
    if (!follows || ((!changed || ahead_is_free(state, obstacles)) && holds_on(state, obstacles))) {
      return;
    }
  }
  direct_ = false;
  const bool out_of_budget = status_ == PlanStatus::no_path || status_ == PlanStatus::timeout;
  if (failed_ && out_of_budget && !changed && !stuck && state.time - failed_at_ < settings_.retry) {
    return;
  }
  search(state, obstacles);
}

Eigen::VectorXd Guide::on_route(double station) const {
  const Eigen::VectorXd& at = route_.station;
  const Eigen::Index last = at.size() - 1;
  const Eigen::Index next = std::clamp<Eigen::Index>(std::upper_bound(at.begin(), at.end(), station) - at.begin(), 1, last);
  const double length = at[next] - at[next - 1];
  const double share = length > 0.0 ? std::clamp((station - at[next - 1]) / length, 0.0, 1.0) : 1.0;
  return route_.q.col(next - 1) + share * (route_.q.col(next) - route_.q.col(next - 1));
}

Eigen::Index Guide::waypoint_after(double station) const {
  const auto next = std::upper_bound(stations_.begin(), stations_.end(), station) - stations_.begin();
  return std::min<Eigen::Index>(next, stations_.size() - 1);
}

bool Guide::ahead_is_free(const State& state, const Obstacles& obstacles) {
  // With what the path was made with. An obstacle that comes a little nearer bends the motion, it does not block the path:
  // half the margin is enough.
  Margins margins = path_margins_;
  margins.margin *= 0.5;
  margins.pair_margin *= 0.5;
  Eigen::VectorXd from = on_route(state.station);
  for (Eigen::Index next = waypoint_after(state.station); next < path_.cols(); ++next) {
    if (!body_.edge_free(from, path_.col(next), obstacles, margins, planner_.workspace())) {
      return false;
    }
    from = path_.col(next);
  }
  return true;
}

bool Guide::holds_on(const State& state, const Obstacles& obstacles) {
  const double floor = settings_.planner.floor;
  if (planner_.sees(state.q, on_route(state.station), floor, obstacles)) {
    return true;
  }
  const Eigen::VectorXd here = within_limits(state.q);
  Obstruction obstruction;
  if (planner_.obstructed(here, obstacles, obstruction)) {
    return false;
  }
  Eigen::MatrixXd path = path_;
  if (!planner_.enter(path, waypoint_after(state.station), path_margins_.margin, here, obstacles)) {
    double station = state.station;
    const double earliest = std::max(0.0, station - settings_.route.lead);
    do {
      if (station <= earliest) {
        return false;
      }
      station = std::max(earliest, station - back);
    } while (!planner_.sees(here, on_route(station), floor, obstacles));
    const Eigen::Index rest = path_.cols() - waypoint_after(station);
    path.resize(path_.rows(), rest + 2);
    path << here, on_route(station), path_.rightCols(rest);
  }
  path_margins_ = planner_.margins(path_margins_.margin, here, state.goal, obstacles);
  follow(state, path, obstacles, true);
  return true;
}

void Guide::search(const State& state, const Obstacles& obstacles) {
  const double margin = std::max(margin_, settings_.planner.floor);
  const std::uint64_t seed = settings_.seed + searches_++;
  Plan plan = planner_.find(within_limits(state.q), state.goal, obstacles, seed);
  const PlanStatus status = plan.status;
  const bool found = status == PlanStatus::found;
  have_path_ = found;
  failed_ = !found;
  failed_at_ = state.time;
  if (found) {
    ++path_number_;
    const Plan first = plan;
    if (!settings_.synchronous) {  // to begin with
      follow(state, plan.path, obstacles, false);
    }
    planner_.improve(plan, obstacles, seed, margin);
    if (!settings_.synchronous) {
      newer_ = true;
      const Eigen::VectorXd here = within_limits(states_.get().q);
      Obstruction obstruction;
      if (planner_.obstructed(here, obstacles, obstruction) || !planner_.enter(plan.path, 0, plan.margin, here, obstacles)) {
        plan = first;
      }
    }
    ++path_number_;
    path_margins_ = planner_.margins(plan.margin, plan.path.col(0), state.goal, obstacles);
    follow(state, plan.path, obstacles, true);
  }
  {
    const std::lock_guard lock(mutex_);
    shown_ = std::move(plan);
    ++counts_.searches;
    counts_.found += found;
  }
  if (!found) {
    answer(state, status, false);
  }
}

void Guide::follow(const State& state, const Eigen::MatrixXd& path, const Obstacles& obstacles, bool measured) {
  path_ = path;
  stations_ = Eigen::VectorXd::Zero(path_.cols());
  for (Eigen::Index k = 1; k < path_.cols(); ++k) {
    stations_[k] = stations_[k - 1] + (path_.col(k) - path_.col(k - 1)).norm();
  }
  route_ = make_route(path_, body_, obstacles, settings_.route, planner_.workspace(), measured);
  ++route_number_;
  answer(state, PlanStatus::found, false);
}

void Guide::answer(const State& state, PlanStatus status, bool direct) {
  status_ = status;
  Answer& answer = answers_.draft();
  answer.goal_number = state.goal_number;
  answer.status = status;
  answer.direct = direct;
  answer.route_number = route_number_;
  answer.path_number = path_number_;
  if (status == PlanStatus::found && !direct) {
    answer.route = route_;
  }
  answers_.submit();
}

}  // namespace sidestep
