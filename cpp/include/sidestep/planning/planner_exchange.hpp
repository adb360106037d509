#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>

#include "sidestep/math/triple_buffer.hpp"
#include "sidestep/planning/plan.hpp"
#include "sidestep/planning/timed_path.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Exchange between a loop and the planner beside it. The loop's side never waits.
class PlannerExchange {
 public:
  /// Message of the loop to the planner.
  struct State {
    Eigen::VectorXd q, v, goal;
    double time = 0.0, station = 0.0;
    std::uint64_t goal_number = 0;   // Number of the goal; 0: none.
    std::uint64_t route_number = 0;  // Number of the route that it follows.
    std::uint64_t stops = 0;         // Number of times that the arm was stuck on the way to this goal.
    std::chrono::steady_clock::time_point written{};
  };

  /// Message of the planner to the loop.
  struct Answer {
    std::uint64_t goal_number = 0, route_number = 0, path_number = 0;
    PlanStatus status = PlanStatus::no_path;
    double progress = 0.0;                   // Progress on the route that is required within the patience [rad | m].
    std::shared_ptr<const TimedPath> route;  // Route, kept alive by the planner's side: a slot is only overwritten there.
  };
  /// Time of the newest state that was checked, and duration of the check.
  struct Looked {
    double time = -std::numeric_limits<double>::infinity(), duration = 0.0;  // [s], the duration by the machine's clock.
  };

  /// Numbers of searches, and of paths found.
  struct Counts {
    int searches = 0, found = 0;
  };

  explicit PlannerExchange(Eigen::Index nv);

  TripleBuffer<State> states;
  TripleBuffer<Answer> answers;
  TripleBuffer<Looked> looked;

  /// Sets the present obstacles; from any thread. The same points again are no change.
  void set_obstacles(const Obstacles& obstacles);
  /// The newest obstacles if their number is not `seen`, which it becomes; else null.
  std::shared_ptr<const Obstacles> newer_obstacles(std::uint64_t& seen) const;

  /// For callers beside the loop: the result of the last search, and the timed path that is followed.
  void show(Plan plan);
  void show(std::shared_ptr<const TimedPath> route, std::uint64_t number);
  Plan last_plan() const;
  Counts counts() const;
  /// A timed path by its number; null if there is a newer one.
  std::shared_ptr<const TimedPath> route(std::uint64_t number) const;

 private:
  mutable std::mutex mutex_;  // Guards what follows; the loop never takes it.
  std::shared_ptr<const Obstacles> newest_;
  std::uint64_t scene_number_ = 0;
  Plan plan_;
  std::shared_ptr<const TimedPath> route_;
  std::uint64_t route_number_ = 0;
  Counts counts_;
};

}  // namespace sidestep
