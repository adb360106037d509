#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <semaphore>
#include <thread>
#include <utility>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/math/interruption.hpp"
#include "sidestep/math/progress_monitor.hpp"
#include "sidestep/planning/online_planner_settings.hpp"
#include "sidestep/planning/path_keeper.hpp"
#include "sidestep/planning/planner_exchange.hpp"

namespace sidestep {

/// @cond internal
/// Status of a motion that an OnlinePlanner leads.
enum class OnlinePlannerStatus {
  idle,                ///< No goal was given.
  moving,              ///< On the way.
  arrived,             ///< Every joint is at the goal.
  no_path,             ///< No path was found within the budget; searched again when the scene changes, or after a while.
  goal_in_collision,   ///< The goal is blocked; the arm goes there when it becomes free.
  start_in_collision,  ///< The arm is in something; the reactive layer brings it out.
  timeout,             ///< The time for the motion is over; the motion continues.
  invalid,             ///< The goal is outside the position limits, or the state is not finite.
};

/// Short names, for example "goal_in_collision".
const char* name(OnlinePlannerStatus status) noexcept;
/// @endcond

/// Leads an arm to a goal along a path that is searched in the background, by a reference that runs ahead on the path.
///
/// One loop calls `step()` with the state and moves by a GeometricSystem towards the reference. Until there is a path, the
/// reference is the goal itself; a free straight way to the goal is the path. In its own thread the planner checks, every
/// `period`, whether the way ahead is still free among the newest obstacles and the arm makes progress. If not, it searches
/// again from where the arm is; after a stop with a larger margin.
class OnlinePlanner {
 public:
  /// Throws std::invalid_argument that names the setting at fault.
  OnlinePlanner(ClearanceQuery body, const OnlinePlannerConfig& settings);
  ~OnlinePlanner();
  OnlinePlanner(const OnlinePlanner&) = delete;
  OnlinePlanner& operator=(const OnlinePlanner&) = delete;

  /// From the loop that calls `step()`. Throws std::invalid_argument on a size or an entry that is not finite.
  void set_goal(const Eigen::VectorXd& goal);

  /// Sets the present obstacles; from any thread, best that of the camera. Allocates, and waits for no search. The same points
  /// again are no change.
  void set_obstacles(const Obstacles& obstacles) { exchange_.set_obstacles(obstacles); }

  /// The current reference: position, velocity and acceleration (nv) of a JointGoal, and the places where activation distances
  /// shrink, see GeometricSystem::lower_activations. These are the first `num_places` columns of `places` (nv): narrow places
  /// of the path that the arm is about to pass, or the goal if there is none. `arrives`: there are some, and the end of the
  /// path is within the lead, so that the goal counts as well.
  struct Reference {
    explicit Reference(Eigen::Index nv)
        : position(Eigen::VectorXd::Zero(nv)),
          velocity(position),
          acceleration(position),
          places(Eigen::MatrixXd::Zero(nv, TimedPathFollower::most_places)) {}

    Eigen::VectorXd position, velocity, acceleration;
    Eigen::MatrixXd places;
    Eigen::Index num_places = 0;
    bool arrives = false;
  };

  /// Whether a moving obstacle is within 10 cm of the arm, or could be in a second: activation distances shrink only near
  /// static obstacles. For the loop; allocates nothing.
  [[nodiscard]] bool disturbed(ConstVectorRef q, const Obstacles& obstacles) noexcept;

  /// One step of the loop, at a time [s] that never decreases; if it is not finite, nothing changes and the status is
  /// `invalid`. Never blocks; allocates nothing unless synchronous. The path leads on by the time since the last step, by `most` [s] at
  /// most: an arm that was not commanded for longer has stood.
  [[nodiscard]] OnlinePlannerStatus step(ConstVectorRef q, double time, Reference& reference,
                                         double most = std::numeric_limits<double>::infinity()) noexcept;

  /// Age [s] of the state that the planner has checked last, or of the goal, at the time [s] of the last `step`; during a check
  /// by the machine's clock if that is longer. 0: synchronous, or no goal. For the loop.
  double age(double time) const noexcept;

  /// Limits the pace of the reference along the path, see TimedPathFollower; from the loop.
  void limit_pace(double most) noexcept { follower_.most = most; }

  /// Sets a predicate that ends a search of a synchronous planner, as if time ran out.
  void interrupt_when(Interrupted interrupted) {
    if (settings_.synchronous) {
      keeper_.interrupt_when(std::move(interrupted));
    }
  }

  /// Last result of the planner: the path, or what is in the way. A copy; not for the loop.
  Plan last_plan() const { return exchange_.last_plan(); }
  /// Number of the timed path that the loop follows (0: none), and the place on it. For the loop; allocates nothing.
  struct Following {
    std::uint64_t route_number = 0;
    TimedPathFollower follower = {};
  };
  Following following() noexcept;
  /// A timed path by its number; null if there is a newer one. Not for the loop.
  std::shared_ptr<const TimedPath> route(std::uint64_t number) const { return exchange_.route(number); }

  using Counts = PlannerExchange::Counts;
  Counts counts() const { return exchange_.counts(); }
  const OnlinePlannerConfig& settings() const noexcept { return settings_; }
  const ClearanceQuery& body() const noexcept { return body_; }

  using Answer = PlannerExchange::Answer;
  using Looked = PlannerExchange::Looked;
  /// The answer that the last `step` took over, null if there was no new one. For the loop; valid until its next step.
  const Answer* taken() const noexcept { return takes_ ? &exchange_.answers.current() : nullptr; }
  /// The look whose age the last `step` took over, likewise.
  const Looked* taken_look() const noexcept { return takes_look_ ? &exchange_.looked.current() : nullptr; }
  /// Sets the answer that the next `step` takes over, for a planner that does not work by itself.
  void give(Answer answer) { exchange_.answers.put(std::move(answer)); }
  void give(Looked look) { exchange_.looked.put(look); }

 private:
  void run();
  /// Sends the state to the planner's side; checks it at once if synchronous.
  void tell(ConstVectorRef q, double time);
  /// Takes over the answer of the planner's side.
  void hear(double time) noexcept;
  /// Whether the planner's answer is about the goal, and a path.
  bool leads(const Answer& answer) const noexcept {
    return answer.goal_number == goal_number_ && answer.status == PlanStatus::found;
  }
  void lead(const Answer& answer, ConstVectorRef q, double duration, Reference& reference) noexcept;
  /// Counts a stop where the arm makes no progress towards the goal.
  void watch_progress(const Answer& answer, ConstVectorRef q, double time, const Reference& reference) noexcept;
  OnlinePlannerStatus status(const Answer& answer, double time) const noexcept;

  ClearanceQuery body_;
  OnlinePlannerConfig settings_;
  PlannerExchange exchange_;

  // Of the loop.
  Eigen::VectorXd goal_, last_q_, velocity_;
  std::uint64_t goal_number_ = 0;
  double begin_ = 0.0, last_time_ = 0.0, next_look_ = 0.0;
  bool started_ = false, takes_ = false, takes_look_ = false;
  ProgressMonitor progress_;
  TimedPathFollower follower_;
  std::uint64_t stops_ = 0, followed_ = 0, measured_ = 0;
  double looked_at_ = -std::numeric_limits<double>::infinity();  // Time of the newest state that was checked [s].
  double look_excess_ = 0.0;  // Duration of that check by the machine's clock, beyond that by the steps' [s].
  ClearanceQuery::Workspace here_;

  // Of the planner's thread.
  PathKeeper keeper_;
  std::counting_semaphore<> wake_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sidestep
