#include "sidestep/planning/path_keeper.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace sidestep {
namespace {

constexpr double widening = 1.5;  // Factor on the margin each time that the arm was stuck.
constexpr int widenings = 4;      // Number of times after which the margin starts anew.
// Length of a straight way, as a share of the rest of the path, below which it replaces the path [-].
constexpr double shorter = 0.9;
constexpr double progress_share = 0.5;  // Share of the route's progress within the patience that the arm must make [-].
constexpr double back = 0.05;           // Distance of places behind the reference where an arm may rejoin its path [rad].

}  // namespace

PathKeeper::PathKeeper(const ClearanceQuery& body, const OnlinePlannerConfig& settings, PlannerExchange& exchange)
    : body_(body),
      settings_(settings),
      exchange_(exchange),
      search_(body, settings.planner.search),
      obstacles_(std::make_shared<const Obstacles>(Obstacles::none())),
      watch_(body),
      margin_(settings.planner.search.margin) {}

void PathKeeper::interrupt_when_overtaken(const std::atomic<bool>& stopping) {
  search_.interrupt_when([this, &stopping] {
    newer_ = exchange_.states.update() || newer_;
    return stopping.load() || exchange_.states.get().goal_number != seen_goal_ || overtaken();
  });
}

void PathKeeper::update_to_newest() {
  if (!exchange_.states.update() && !newer_) {
    return;
  }
  newer_ = false;
  const State state = exchange_.states.get();  // Copy of the newest state: newer ones arrive while it is checked.
  update(state);
  exchange_.looked.draft() = {state.time,
                              std::chrono::duration<double>(std::chrono::steady_clock::now() - state.written).count()};
  exchange_.looked.submit();
}

void PathKeeper::update(const State& state) noexcept {
  try {
    check_way(state);
  } catch (...) {  // out of memory, for example: begin again at the next look
    have_path_ = direct_ = failed_ = improving_ = overtaken_ = false;
    changed_ = true;
    status_ = PlanStatus::no_path;
  }
}

void PathKeeper::check_way(const State& state) {
  if (state.goal_number == 0) {
    return;
  }
  if (std::shared_ptr<const Obstacles> newest = exchange_.newer_obstacles(seen_scene_)) {
    obstacles_ = std::move(newest);
    changed_ = true;
  }
  const Obstacles& obstacles = *obstacles_;
  if (state.goal_number != seen_goal_) {
    take_goal(state);
  }
  const bool stuck = state.stops != seen_stops_;
  if (stuck) {
    seen_stops_ = state.stops;
    margin_ = settings_.planner.search.margin * std::pow(widening, static_cast<double>(state.stops % widenings));
  }
  if (const std::optional<double> margin = straight_margin(state, obstacles, stuck)) {
    go_straight(state, *margin, obstacles);
    return;
  }
  if (have_path_ && !stuck && !direct_) {
    if (state.route_number != path_.motion_number()) {  // the loop has yet to take it up
      return;
    }
    if ((!changed_ || path_.is_free_from(state.station, body_, obstacles, search_.workspace())) && holds_on(state, obstacles)) {
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

void PathKeeper::take_goal(const State& state) {
  seen_goal_ = state.goal_number;
  seen_stops_ = state.stops;
  have_path_ = direct_ = failed_ = false;
  margin_ = settings_.planner.search.margin;
}

// Straight to the goal where that is free with the margin; not where the arm was stuck, which needs another way.
// To let go of a path it must be wide, as barriers may stop what goes straight through a narrow place, and shorter, among
// obstacles that the path was not made for.
std::optional<double> PathKeeper::straight_margin(const State& state, const Obstacles& obstacles, bool stuck) {
  const bool taken_up = state.route_number == path_.motion_number();
  const bool lets_go = !have_path_ || (changed_ && taken_up &&
                                       (state.goal - state.q).norm() < shorter * (path_.rounded().length() - state.station));
  const PlannerSettings& asked = settings_.planner.search;
  const double wide = have_path_ ? asked.margin : std::sqrt(asked.margin * asked.floor);
  Obstruction found;
  const bool straight = lets_go && state.stops == 0 && !stuck && search_.sees(state.q, state.goal, wide, obstacles) &&
                        !search_.obstructed(state.goal, obstacles, found) && !search_.obstructed(state.q, obstacles, found);
  return straight ? std::optional(wide) : std::nullopt;
}

void PathKeeper::go_straight(const State& state, double margin, const Obstacles& obstacles) {
  const bool taken_up = state.route_number == path_.motion_number();
  const bool strayed =
      direct_ && taken_up && !search_.sees(state.q, path_.at(state.station), settings_.planner.search.floor, obstacles);
  if (direct_ && !strayed && status_ == PlanStatus::found) {
    return;
  }
  direct_ = true;
  have_path_ = failed_ = false;
  ++path_number_;
  Eigen::MatrixXd edge(state.q.size(), 2);
  edge << within_limits(state.q), state.goal;
  follow(state, edge, search_.margins(margin, edge.col(0), state.goal, obstacles), obstacles, true);
}

bool PathKeeper::overtaken() {
  if (!improving_ || overtaken_) {
    return overtaken_;
  }
  const std::shared_ptr<const Obstacles> newest = exchange_.newer_obstacles(watched_scene_);
  if (!newest) {
    return false;
  }
  const State& state = exchange_.states.get();
  overtaken_ = !path_.is_free_from(state.route_number == path_.motion_number() ? state.station : 0.0, body_, *newest, watch_);
  return overtaken_;
}

bool PathKeeper::holds_on(const State& state, const Obstacles& obstacles) {
  const double floor = settings_.planner.search.floor;
  if (search_.sees(state.q, path_.at(state.station), floor, obstacles)) {
    return true;
  }
  const Eigen::VectorXd here = within_limits(state.q);
  Obstruction obstruction;
  if (search_.obstructed(here, obstacles, obstruction)) {
    return false;
  }
  Eigen::MatrixXd path = path_.waypoints();
  if (!search_.enter(path, path_.waypoint_after(state.station), path_.margins().margin, here, obstacles)) {
    double station = state.station;
    const double earliest = std::max(0.0, station - settings_.planner.route.lead);
    do {
      if (station <= earliest) {
        return false;
      }
      station = std::max(earliest, station - back);
    } while (!search_.sees(here, path_.at(station), floor, obstacles));
    const Eigen::Index rest = path_.waypoints().cols() - path_.waypoint_after(station);
    path.resize(path.rows(), rest + 2);
    path << here, path_.at(station), path_.waypoints().rightCols(rest);
  }
  follow(state, path, search_.margins(path_.margins().margin, here, state.goal, obstacles), obstacles, true);
  return true;
}

void PathKeeper::search(const State& state, const Obstacles& obstacles) {
  const double margin = std::max(margin_, settings_.planner.search.floor);
  const std::uint64_t seed = settings_.seed + searches_++;
  Plan plan = search_.find(within_limits(state.q), state.goal, obstacles, seed);
  const PlanStatus status = plan.status;
  const bool found = status == PlanStatus::found;
  have_path_ = found;
  failed_ = !found;
  failed_at_ = state.time;
  if (found && improve(plan, state, obstacles, seed, margin)) {  // else the next look, at once, finds another way
    ++path_number_;
    follow(state, plan.path, search_.margins(plan.margin, plan.path.col(0), state.goal, obstacles), obstacles, true);
  }
  exchange_.show(std::move(plan));
  if (!found) {
    answer(state, status);
  }
}

bool PathKeeper::improve(Plan& plan, const State& state, const Obstacles& obstacles, std::uint64_t seed, double margin) {
  ++path_number_;
  const Margins kept = search_.margins(plan.margin, plan.path.col(0), state.goal, obstacles);
  if (settings_.synchronous) {
    search_.improve(plan, obstacles, seed, margin);
    return true;
  }
  const Plan first = plan;
  follow(state, plan.path, kept, obstacles, false);
  improving_ = true;
  watched_scene_ = seen_scene_;
  search_.improve(plan, obstacles, seed, margin);
  const bool blocked = overtaken_;
  improving_ = overtaken_ = false;
  newer_ = true;
  if (!blocked) {
    const Eigen::VectorXd here = within_limits(exchange_.states.get().q);
    Obstruction obstruction;
    if (search_.obstructed(here, obstacles, obstruction) || !search_.enter(plan.path, 0, plan.margin, here, obstacles)) {
      plan = first;
    }
  }
  return !blocked;
}

void PathKeeper::follow(const State& state, const Eigen::MatrixXd& path, const Margins& margins, const Obstacles& obstacles,
                        bool measured) {
  path_.replace(path, margins, body_, obstacles, search_.workspace());
  const Eigen::VectorXd v = settings_.synchronous ? state.v : exchange_.states.get().v;
  path_.time(make_route(path_.rounded(), v, body_, obstacles, settings_.planner.route, settings_.safety, search_.workspace(),
                        measured, settings_.dynamics ? &*settings_.dynamics : nullptr));
  answer(state, PlanStatus::found);
}

void PathKeeper::answer(const State& state, PlanStatus status) {
  status_ = status;
  PlannerExchange::Answer& answer = exchange_.answers.draft();
  answer.goal_number = state.goal_number;
  answer.status = status;
  answer.route_number = path_.motion_number();
  answer.path_number = path_number_;
  if (status == PlanStatus::found) {
    answer.route = path_.motion();
    // A prismatic joint at 1 cm/s, or a narrow place, is no reason to look for another way.
    answer.progress = std::min(usual_progress, progress_share * path_.motion()->motion.slowest(settings_.planner.patience));
    exchange_.show(path_.motion(), path_.motion_number());
  }
  exchange_.answers.submit();
}

}  // namespace sidestep
