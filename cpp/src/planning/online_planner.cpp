#include "sidestep/planning/online_planner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

constexpr double disturbing = 0.1;  // Distance of something moving from the arm that counts as a disturbance [m].
constexpr double foresight = 1.0;   // Time in which it could come that close [s].

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

OnlinePlanner::OnlinePlanner(ClearanceQuery body, const OnlinePlannerConfig& settings)
    : body_(std::move(body)),
      settings_((settings.validate(), settings)),
      exchange_(body_.robot().num_coordinates()),
      goal_(Eigen::VectorXd::Zero(body_.robot().num_coordinates())),
      last_q_(goal_),
      velocity_(goal_),
      progress_(settings.planner.patience),
      here_(body_),
      keeper_(body_, settings_, exchange_) {
  if (settings_.works && !settings_.synchronous) {
    keeper_.interrupt_when_overtaken(stopping_);
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

void OnlinePlanner::run() {
  while (!stopping_.load()) {
    static_cast<void>(wake_.try_acquire_for(std::chrono::duration<double>(settings_.planner.period)));
    if (!stopping_.load()) {
      keeper_.update_to_newest();
    }
  }
}

bool OnlinePlanner::disturbed(ConstVectorRef q, const Obstacles& obstacles) noexcept {
  return body_.nearest_moving(q, obstacles, foresight, here_) < disturbing;
}

OnlinePlannerStatus OnlinePlanner::step(ConstVectorRef q, double time, Reference& reference, double most) noexcept {
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
  tell(q, time);
  hear(time);
  const Answer& answer = exchange_.answers.current();
  lead(answer, q, std::min(time - last_time_, most), reference);
  last_time_ = time;

  if ((q - goal_).cwiseAbs().maxCoeff() < settings_.tolerance) {
    progress_.reset();
    return OnlinePlannerStatus::arrived;
  }
  watch_progress(answer, q, time, reference);
  return status(answer, time);
}

void OnlinePlanner::tell(ConstVectorRef q, double time) {
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
  // In a thread the planner looks at its own pace, and at once at a new goal.
  if (settings_.synchronous && time < next_look_) {
    return;
  }
  PlannerExchange::State& state = exchange_.states.draft();
  state.q = q;
  state.v = velocity_;
  state.goal = goal_;
  state.time = time;
  state.station = follower_.station;
  state.goal_number = goal_number_;
  state.route_number = followed_;
  state.stops = stops_;
  state.written = std::chrono::steady_clock::now();
  exchange_.states.submit();
  if (settings_.synchronous) {
    next_look_ = time + settings_.planner.period;
    keeper_.update(exchange_.states.get());
  } else if (first) {
    wake_.release();
  }
}

void OnlinePlanner::hear(double time) noexcept {
  takes_look_ = exchange_.looked.update();
  if (takes_look_) {
    const Looked& looked = exchange_.looked.current();
    looked_at_ = looked.time;
    look_excess_ = std::max(0.0, looked.duration - (time - looked.time));
  }
  takes_ = exchange_.answers.update();
}

void OnlinePlanner::lead(const Answer& answer, ConstVectorRef q, double duration, Reference& reference) noexcept {
  if (!leads(answer)) {
    reference.position = goal_;
    return;
  }
  if (answer.route_number != followed_) {
    followed_ = answer.route_number;
    follower_.enter(*answer.route, q, velocity_);
  }
  reference.position.resize(goal_.size());
  const TimedPathSettings& settings = settings_.planner.route;
  follower_.advance(*answer.route, settings, q, duration, reference.position, reference.velocity, reference.acceleration);
  if (const Eigen::Index num = follower_.narrow(*answer.route, settings, reference.places); num > 0) {
    reference.num_places = num;
    reference.arrives = answer.route->length() - follower_.station <= settings.lead;
  }
}

void OnlinePlanner::watch_progress(const Answer& answer, ConstVectorRef q, double time, const Reference& reference) noexcept {
  const double left = leads(answer) ? answer.route->length() - follower_.station : 0.0;
  const double away = (reference.position - q).norm() + left;
  if (answer.goal_number == goal_number_ && answer.path_number != measured_) {  // another way may be longer
    measured_ = answer.path_number;
    progress_.reset();
  }
  if (progress_.update_way(time, away, leads(answer) ? answer.progress : PathKeeper::usual_progress)) {
    ++stops_;
    progress_.reset();
  }
}

OnlinePlannerStatus OnlinePlanner::status(const Answer& answer, double time) const noexcept {
  if (answer.goal_number == goal_number_) {
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
  const Answer& answer = exchange_.answers.current();
  return {leads(answer) && answer.route_number == followed_ ? followed_ : 0, follower_};
}

}  // namespace sidestep
