#include "sidestep/planning/planner_exchange.hpp"

#include <utility>

namespace sidestep {

PlannerExchange::PlannerExchange(Eigen::Index nv)
    : states(State{Eigen::VectorXd::Zero(nv), Eigen::VectorXd::Zero(nv), Eigen::VectorXd::Zero(nv)}),
      answers(Answer{}),
      looked(Looked{}),
      newest_(std::make_shared<const Obstacles>(Obstacles::none())) {}

void PlannerExchange::set_obstacles(const Obstacles& obstacles) {
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

std::shared_ptr<const Obstacles> PlannerExchange::newer_obstacles(std::uint64_t& seen) const {
  const std::lock_guard lock(mutex_);
  if (seen == scene_number_) {
    return nullptr;
  }
  seen = scene_number_;
  return newest_;
}

void PlannerExchange::show(Plan plan) {
  const std::lock_guard lock(mutex_);
  plan_ = std::move(plan);
  ++counts_.searches;
  counts_.found += plan_.status == PlanStatus::found;
}

void PlannerExchange::show(std::shared_ptr<const TimedPath> route, std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  route_ = std::move(route);
  route_number_ = number;
}

Plan PlannerExchange::last_plan() const {
  const std::lock_guard lock(mutex_);
  return plan_;
}

PlannerExchange::Counts PlannerExchange::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::shared_ptr<const TimedPath> PlannerExchange::route(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  return number != 0 && number == route_number_ ? route_ : nullptr;
}

}  // namespace sidestep
