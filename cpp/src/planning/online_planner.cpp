#include "sidestep/planning/online_planner.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double disturbing = 0.1;  // [m] from the arm of what moves
constexpr double foresight = 1.0;   // [s] in which it could be

}  // namespace

const char* name(OnlinePlannerStatus status) noexcept {
  switch (status) {
    case OnlinePlannerStatus::idle: return "idle";
    case OnlinePlannerStatus::moving: return "moving";
    case OnlinePlannerStatus::arrived: return "arrived";
    case OnlinePlannerStatus::no_path: return "no_path";
    case OnlinePlannerStatus::goal_in_collision: return "goal_in_collision";
    case OnlinePlannerStatus::start_in_collision: return "start_in_collision";
    case OnlinePlannerStatus::timeout: return "timeout";
    case OnlinePlannerStatus::invalid: return "invalid";
  }
  return "unknown";
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

void OnlinePlannerConfig::validate() const {
  planner.search.validate();
  planner.route.validate();
  const auto positive = [](double value, const char* what) { require(value > 0.0, what, value, "positive"); };
  positive(planner.period, "online planner: period");
  positive(planner.patience, "online planner: patience");
  positive(planner.retry, "online planner: retry");
  positive(tolerance, "online planner: tolerance");
  positive(duration, "online planner: duration");
}

OnlinePlanner::OnlinePlanner(BodyClearance body, const OnlinePlannerConfig& settings)
    : body_(std::move(body)),
      settings_((settings.validate(), settings)),
      goal_(Eigen::VectorXd::Zero(body_.robot().num_coordinates())),
      last_q_(goal_),
      velocity_(goal_),
      progress_(settings.planner.patience),
      here_(body_),
      states_(State{goal_, goal_, goal_}),
      answers_(Answer{}),
      looked_(Looked{}),
      newest_(std::make_shared<const Obstacles>(Obstacles::none())),
      planner_(body_, settings.planner.search),
      obstacles_(newest_),
      watch_(body_),
      margin_(settings.planner.search.margin) {
  if (settings_.works && !settings_.synchronous) {
    planner_.interrupt_when([this] {
      newer_ = states_.update() || newer_;
      return stopping_.load() || states_.get().goal_number != seen_goal_ || overtaken();
    });
    thread_ = std::thread([this] { run(); });
  }
}

OnlinePlanner::~OnlinePlanner() {
  stopping_.store(true);
  wake_.release();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void OnlinePlanner::set_goal(const Eigen::VectorXd& goal) {
  if (goal.size() != goal_.size() || !goal.allFinite()) {
    throw std::invalid_argument("online planner: the goal has " + std::to_string(goal.size()) + " entries, " +
                                std::to_string(goal_.size()) + " finite ones are needed");
  }
  goal_ = goal;
  ++goal_number_;
  started_ = false;
  stops_ = 0;
  progress_.reset();
}

void OnlinePlanner::set_obstacles(const Obstacles& obstacles) {
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

bool OnlinePlanner::disturbed(ConstVectorRef q, const Obstacles& obstacles) noexcept {
  return body_.nearest_moving(q, obstacles, foresight, here_) < disturbing;
}

OnlinePlannerStatus OnlinePlanner::step(ConstVectorRef q, double time, Reference& reference) noexcept {
  reference.velocity.setZero(goal_.size());
  reference.acceleration.setZero(goal_.size());
  reference.places.col(0) = goal_;
  reference.num_places = 1;
  reference.arrives = takes_ = takes_look_ = false;
  if (goal_number_ == 0 || q.size() != goal_.size() || !q.allFinite() || !std::isfinite(time)) {
    reference.position = goal_;
    if (q.size() == goal_.size()) {
      reference.position = q;
    }
    return goal_number_ == 0 ? OnlinePlannerStatus::idle : OnlinePlannerStatus::invalid;
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
  // Tell the planner; in a thread it looks at its own pace, and at once at a new goal.
  if (!settings_.synchronous || time >= next_look_) {
    State& state = states_.draft();
    state.q = q;
    state.v = velocity_;
    state.goal = goal_;
    state.time = time;
    state.station = follower_.station;
    state.goal_number = goal_number_;
    state.route_number = followed_;
    state.stops = stops_;
    state.written = std::chrono::steady_clock::now();
    states_.submit();
    if (settings_.synchronous) {
      next_look_ = time + settings_.planner.period;
      look_safely(states_.get());
    } else if (first) {
      wake_.release();
    }
  }

  takes_look_ = looked_.update();
  if (takes_look_) {
    const Looked& looked = looked_.current();
    looked_at_ = looked.time;
    look_excess_ = std::max(0.0, looked.duration - (time - looked.time));
  }
  takes_ = answers_.update();
  const Answer& answer = answers_.current();
  const bool ours = answer.goal_number == goal_number_;
  if (ours && answer.status == PlanStatus::found) {
    if (answer.route_number != followed_) {
      followed_ = answer.route_number;
      follower_.enter(*answer.route, q, velocity_);
    }
    reference.position.resize(goal_.size());
    follower_.advance(*answer.route, settings_.planner.route, q, time - last_time_, reference.position, reference.velocity,
                      reference.acceleration);
    if (const Eigen::Index num = follower_.narrow(*answer.route, settings_.planner.route, reference.places); num > 0) {
      reference.num_places = num;
      reference.arrives = answer.route->length() - follower_.station <= settings_.planner.route.lead;
    }
  } else {
    reference.position = goal_;
  }
  last_time_ = time;

  if ((q - goal_).cwiseAbs().maxCoeff() < settings_.tolerance) {
    progress_.reset();
    return OnlinePlannerStatus::arrived;
  }
  const double left = ours && answer.status == PlanStatus::found ? answer.route->length() - follower_.station : 0.0;
  const double away = (reference.position - q).norm() + left;
  if (ours && answer.path_number != measured_) {  // another way may be longer
    measured_ = answer.path_number;
    progress_.reset();
  }
  const double progress = ours && answer.status == PlanStatus::found ? answer.progress : usual_progress;
  if (progress_.update_way(time, away, progress)) {
    ++stops_;
    progress_.reset();
  }
  if (ours) {
    switch (answer.status) {
      case PlanStatus::start_in_collision: return OnlinePlannerStatus::start_in_collision;
      case PlanStatus::goal_in_collision: return OnlinePlannerStatus::goal_in_collision;
      case PlanStatus::invalid: return OnlinePlannerStatus::invalid;
      case PlanStatus::no_path:
      case PlanStatus::timeout: return OnlinePlannerStatus::no_path;
      case PlanStatus::found: break;
    }
  }
  return time - begin_ > settings_.duration ? OnlinePlannerStatus::timeout : OnlinePlannerStatus::moving;
}

double OnlinePlanner::age(double time) const noexcept {
  if (settings_.synchronous || !started_) {
    return 0.0;
  }
  return std::max(0.0, looked_at_ < begin_ ? time - begin_ : time - looked_at_ + look_excess_);
}

OnlinePlanner::Following OnlinePlanner::following() noexcept {
  const Answer& answer = answers_.current();
  const bool follows =
      answer.goal_number == goal_number_ && answer.status == PlanStatus::found && answer.route_number == followed_;
  return {follows ? followed_ : 0, follower_};
}

std::shared_ptr<const TimedPath> OnlinePlanner::route(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  return number != 0 && number == shown_route_number_ ? shown_route_ : nullptr;
}

Plan OnlinePlanner::last_plan() const {
  const std::lock_guard lock(mutex_);
  return shown_;
}

OnlinePlanner::Counts OnlinePlanner::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace sidestep
