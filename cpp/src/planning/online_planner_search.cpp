// The part of the planner beside the loop: looks at the scene, finds paths and keeps to them.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "sidestep/planning/online_planner.hpp"

namespace sidestep {
namespace {

constexpr double widening = 1.5;        // the margin grows by this factor each time the arm was stuck
constexpr int widenings = 4;            // and begins anew after so many
constexpr double shorter = 0.9;         // a straight way is shorter than the rest of a path by this factor to let go of it
constexpr double progress_share = 0.5;  // of the way that a route makes within the patience, that the arm must make
constexpr double back = 0.05;           // between places behind the reference where an arm may find back to its path [rad]

}  // namespace

void OnlinePlanner::run() {
  while (!stopping_.load()) {
    static_cast<void>(wake_.try_acquire_for(std::chrono::duration<double>(settings_.planner.period)));
    if ((states_.update() || newer_) && !stopping_.load()) {
      newer_ = false;
      const State state = states_.get();  // a copy: newer ones come while it looks
      look_safely(state);
      looked_.draft() = {state.time, std::chrono::duration<double>(std::chrono::steady_clock::now() - state.written).count()};
      looked_.submit();
    }
  }
}

void OnlinePlanner::look_safely(const State& state) noexcept {
  try {
    look(state);
  } catch (...) {  // out of memory, for example: begin again at the next look
    have_path_ = direct_ = failed_ = improving_ = overtaken_ = false;
    changed_ = true;
    status_ = PlanStatus::no_path;
  }
}

void OnlinePlanner::look(const State& state) {
  if (state.goal_number == 0) {
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (scene_number_ != seen_scene_) {
      obstacles_ = newest_;
      seen_scene_ = scene_number_;
      changed_ = true;
    }
  }
  const Obstacles& obstacles = *obstacles_;
  const bool new_goal = state.goal_number != seen_goal_;
  if (new_goal) {
    seen_goal_ = state.goal_number;
    seen_stops_ = state.stops;
    have_path_ = direct_ = failed_ = false;
    margin_ = settings_.planner.search.margin;
  }
  bool stuck = false;
  if (state.stops != seen_stops_) {
    seen_stops_ = state.stops;
    stuck = true;
    margin_ = settings_.planner.search.margin * std::pow(widening, static_cast<double>(state.stops % widenings));
  }
  // Straight to the goal where that is free with the margin; not where the arm was stuck, which needs another way.
  // To let go of a path it must be wide, as barriers may stop what goes straight through a narrow place, and shorter, among
  // obstacles that the path was not made for.
  const bool taken_up = state.route_number == route_number_;
  const bool lets_go =
      !have_path_ || (changed_ && taken_up && (state.goal - state.q).norm() < shorter * (rounded_->length() - state.station));
  const PlannerSettings& asked = settings_.planner.search;
  const double wide = have_path_ ? asked.margin : std::sqrt(asked.margin * asked.floor);
  const bool straight = lets_go && state.stops == 0 && !stuck && planner_.sees(state.q, state.goal, wide, obstacles);
  if (straight) {
    Obstruction found;
    if (!planner_.obstructed(state.goal, obstacles, found) && !planner_.obstructed(state.q, obstacles, found)) {
      const bool strayed = direct_ && taken_up && !planner_.sees(state.q, on_route(state.station), asked.floor, obstacles);
      if (!direct_ || strayed || status_ != PlanStatus::found) {
        direct_ = true;
        have_path_ = failed_ = false;
        ++path_number_;
        Eigen::MatrixXd edge(state.q.size(), 2);
        edge << within_limits(state.q), state.goal;
        path_margins_ = planner_.margins(wide, edge.col(0), state.goal, obstacles);
        follow(state, edge, obstacles, true);
      }
      return;
    }
  }
  if (have_path_ && !stuck && !direct_) {
    if (!taken_up) {  // the loop has yet to take it up
      return;
    }
    if ((!changed_ || ahead_is_free(state.station, obstacles, planner_.workspace())) && holds_on(state, obstacles)) {
      changed_ = false;
      return;
    }
  }
  direct_ = false;
  const bool out_of_budget = status_ == PlanStatus::no_path || status_ == PlanStatus::timeout;
  if (failed_ && out_of_budget && !changed_ && !stuck && state.time - failed_at_ < settings_.planner.retry) {
    return;
  }
  changed_ = false;
  search(state, obstacles);
}

Eigen::VectorXd OnlinePlanner::on_route(double station) const {
  RoundedPath::Point point;
  rounded_->at(station, point);
  return point.q;
}

Eigen::Index OnlinePlanner::waypoint_after(double station) const {
  const auto next = std::upper_bound(stations_.begin(), stations_.end(), station) - stations_.begin();
  return std::min<Eigen::Index>(next, stations_.size() - 1);
}

bool OnlinePlanner::ahead_is_free(double station, const Obstacles& obstacles, BodyClearance::Workspace& w) const {
  // With what the path was made with. An obstacle that comes a little nearer bends the motion, it does not block the
  // path: half the margin is enough.
  Margins margins = path_margins_;
  margins.margin *= 0.5;
  margins.pair_margin *= 0.5;
  Eigen::VectorXd from = on_route(station);
  for (Eigen::Index next = waypoint_after(station); next < path_.cols(); ++next) {
    if (!body_.edge_free(from, path_.col(next), obstacles, margins, w)) {
      return false;
    }
    from = path_.col(next);
  }
  return true;
}

bool OnlinePlanner::overtaken() {
  if (!improving_ || overtaken_) {
    return overtaken_;
  }
  std::shared_ptr<const Obstacles> newest;
  {
    const std::lock_guard lock(mutex_);
    if (scene_number_ == watched_scene_) {
      return false;
    }
    watched_scene_ = scene_number_;
    newest = newest_;
  }
  const State& state = states_.get();
  overtaken_ = !ahead_is_free(state.route_number == route_number_ ? state.station : 0.0, *newest, watch_);
  return overtaken_;
}

bool OnlinePlanner::holds_on(const State& state, const Obstacles& obstacles) {
  const double floor = settings_.planner.search.floor;
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
    const double earliest = std::max(0.0, station - settings_.planner.route.lead);
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

void OnlinePlanner::search(const State& state, const Obstacles& obstacles) {
  const double margin = std::max(margin_, settings_.planner.search.floor);
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
    path_margins_ = planner_.margins(plan.margin, plan.path.col(0), state.goal, obstacles);
    if (!settings_.synchronous) {  // to begin with
      follow(state, plan.path, obstacles, false);
      improving_ = true;
      watched_scene_ = seen_scene_;
    }
    planner_.improve(plan, obstacles, seed, margin);
    const bool blocked = overtaken_;
    improving_ = overtaken_ = false;
    newer_ = !settings_.synchronous;
    if (!settings_.synchronous && !blocked) {
      const Eigen::VectorXd here = within_limits(states_.get().q);
      Obstruction obstruction;
      if (planner_.obstructed(here, obstacles, obstruction) || !planner_.enter(plan.path, 0, plan.margin, here, obstacles)) {
        plan = first;
      }
    }
    if (!blocked) {  // else the next look, at once, finds another way
      ++path_number_;
      path_margins_ = planner_.margins(plan.margin, plan.path.col(0), state.goal, obstacles);
      follow(state, plan.path, obstacles, true);
    }
  }
  {
    const std::lock_guard lock(mutex_);
    shown_ = std::move(plan);
    ++counts_.searches;
    counts_.found += found;
  }
  if (!found) {
    answer(state, status);
  }
}

void OnlinePlanner::follow(const State& state, const Eigen::MatrixXd& path, const Obstacles& obstacles, bool measured) {
  path_ = path;
  stations_ = Eigen::VectorXd::Zero(path_.cols());
  for (Eigen::Index k = 1; k < path_.cols(); ++k) {
    stations_[k] = stations_[k - 1] + (path_.col(k) - path_.col(k - 1)).norm();
  }
  rounded_.emplace(path_, body_, obstacles, path_margins_, planner_.workspace());
  const Eigen::VectorXd v = settings_.synchronous ? state.v : states_.get().v;
  route_ = std::make_shared<const TimedPath>(make_route(*rounded_, v, body_, obstacles, settings_.planner.route,
                                                        settings_.safety, planner_.workspace(), measured,
                                                        settings_.dynamics ? &*settings_.dynamics : nullptr));
  ++route_number_;
  answer(state, PlanStatus::found);
}

void OnlinePlanner::answer(const State& state, PlanStatus status) {
  status_ = status;
  Answer& answer = answers_.draft();
  answer.goal_number = state.goal_number;
  answer.status = status;
  answer.route_number = route_number_;
  answer.path_number = path_number_;
  if (status == PlanStatus::found) {
    answer.route = route_;
    // A joint that slides at 1 cm/s, or a narrow place, is no reason to look for another way.
    answer.progress = std::min(usual_progress, progress_share * route_->motion.slowest(settings_.planner.patience));
    const std::lock_guard lock(mutex_);
    shown_route_ = route_;
    shown_route_number_ = route_number_;
  }
  answers_.submit();
}

}  // namespace sidestep
