#pragma once

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <semaphore>
#include <thread>

#include "sidestep/math/triple_buffer.hpp"
#include "sidestep/math/progress_monitor.hpp"
#include "sidestep/clearance/body_clearance.hpp"
#include "sidestep/planning/plan.hpp"
#include "sidestep/planning/timed_path.hpp"
#include "sidestep/planning/rrt_connect.hpp"

namespace sidestep {

/// What a motion led by an OnlinePlanner is about.
enum class OnlinePlannerStatus {
  idle,                ///< no goal was given
  moving,              ///< on the way
  arrived,             ///< every joint is at the goal
  no_path,             ///< none was found within the budget; looked for again when the scene changes, or after a while
  goal_in_collision,   ///< the goal is blocked; it is gone to when it becomes free
  start_in_collision,  ///< the arm is in something; the reactive layer brings it out
  timeout,             ///< the time for the motion is over; it goes on
  invalid,             ///< the goal is outside the position limits, or the state is not finite
};

/// Short names, for example "goal_in_collision".
const char* name(OnlinePlannerStatus status) noexcept;

/// How an OnlinePlanner searches, and how its paths are followed.
struct OnlinePlannerSettings {
  PlannerSettings search = {};
  TimedPathSettings route = {};
  double period = 0.02;   ///< between two looks at the scene [s]
  double patience = 1.0;  ///< without progress until it plans again [s]
  double retry = 1.0;     ///< until a failed search is repeated in the same scene [s]
};
template <>
const std::vector<Field<OnlinePlannerSettings>>& fields();

/// What an OnlinePlanner is made for.
struct OnlinePlannerConfig {
  OnlinePlannerSettings planner = {};
  std::optional<RigidBodyDynamics> dynamics;  ///< of an arm that is moved by torque: paths are timed for its motors
  SafetySettings safety = {};  ///< of what follows: margin, rate and braking_fraction bound the speed near obstacles
  double tolerance = 0.05;     ///< it has arrived once every joint is this close to the goal [rad | m]
  double duration = std::numeric_limits<double>::infinity();  ///< allowed for a motion [s]
  std::uint64_t seed = 0;
  /// Plans in `step()`, at times given by the planner's period alone, so that a motion is the same every time; else in a thread.
  bool synchronous = false;
  /// Plans at all, where it is not synchronous. Without, the loop takes over what `give` hands it: for replays.
  bool works = true;

  /// Throws std::invalid_argument that names the setting at fault.
  void validate() const;
};

/// Leads an arm to a goal by a path that is searched in the background: a reference that runs ahead on the path.
///
/// One loop calls `step()` with the state and moves by a GeometricSystem towards the reference. Until there is a path the
/// reference is the goal itself; where the straight way to the goal is free, it is the path. In its own thread the
/// planner looks, every `period`, whether the way ahead is still free among the newest obstacles and the arm makes
/// progress, and searches again from where the arm is where that is not so; after a stop with a larger margin.
class OnlinePlanner {
 public:
  /// Throws std::invalid_argument that names the setting at fault.
  OnlinePlanner(BodyClearance body, const OnlinePlannerConfig& settings);
  ~OnlinePlanner();
  OnlinePlanner(const OnlinePlanner&) = delete;
  OnlinePlanner& operator=(const OnlinePlanner&) = delete;

  /// From the loop that calls `step()`. Throws std::invalid_argument on a size or an entry that is not finite.
  void set_goal(const Eigen::VectorXd& goal);

  /// The obstacles as they are seen now; from any thread, best the camera's. It allocates, and waits for no search.
  /// The same points again are no change.
  void set_obstacles(const Obstacles& obstacles);

  /// The current reference: position, velocity and acceleration (nv) of a JointGoal; and where activation distances
  /// shrink, see GeometricSystem::lower_activations: at the first `num_places` columns of `places` (nv), the narrow
  /// places of the path that the arm is about to pass, or the goal where there is none; at the goal as well where the
  /// arm `arrives`: there are some, and the end of the path is within the lead.
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

  /// Whether an obstacle that moves is within 10 cm of the arm, or could be in a second: barriers that leave room at
  /// places are for what rests. For the loop; allocates nothing.
  [[nodiscard]] bool disturbed(ConstVectorRef q, const Obstacles& obstacles) noexcept;

  /// One step of the loop, at a time [s] that does not go back; where it is not finite, nothing changes and the status
  /// is `invalid`. Never blocks; allocates nothing unless synchronous.
  [[nodiscard]] OnlinePlannerStatus step(ConstVectorRef q, double time, Reference& reference) noexcept;

  /// Time since the state that the planner has looked at last, or since the goal was set, at a time [s] of the last `step`; in a
  /// look by the machine's clock where that is longer. 0: synchronous, or no goal. For the loop.
  double age(double time) const noexcept;

  /// The pace that the reference may go at along the path at most, see TimedPathFollower; from the loop.
  void limit_pace(double most) noexcept { follower_.most = most; }

  /// For a synchronous planner: ends a search under way once it says so, as if time ran out.
  void interrupt_when(Interrupted interrupted) {
    if (settings_.synchronous) {
      planner_.interrupt_when(std::move(interrupted));
    }
  }

  /// What the planner found last: the path, or what is in the way. A copy; not for the loop.
  Plan last_plan() const;
  /// Which timed path the loop follows, 0 if none, and where it is on it. For the loop; allocates nothing.
  struct Following {
    std::uint64_t route_number = 0;
    TimedPathFollower follower = {};
  };
  Following following() noexcept;
  /// A timed path by its number; null if there is a newer one. Not for the loop.
  std::shared_ptr<const TimedPath> route(std::uint64_t number) const;

  /// How often it searched for a path, and how often it found one.
  struct Counts {
    int searches = 0, found = 0;
  };
  Counts counts() const;
  const OnlinePlannerConfig& settings() const noexcept { return settings_; }
  const BodyClearance& body() const noexcept { return body_; }

  /// What the planner tells the loop.
  struct Answer {
    std::uint64_t goal_number = 0, route_number = 0, path_number = 0;
    PlanStatus status = PlanStatus::no_path;
    double progress = 0.0;                   // on the route, that is asked for within the patience [rad | m]
    std::shared_ptr<const TimedPath> route;  // kept alive by the planner's side: a slot is only overwritten there
  };
  /// The newest state that was looked at, and for how long.
  struct Looked {
    double time = -std::numeric_limits<double>::infinity(), duration = 0.0;  // [s], the latter by the machine's clock
  };
  /// The answer that the last `step` took over, null if there was no new one. For the loop; valid until its next step.
  const Answer* taken() const noexcept { return takes_ ? &answers_.current() : nullptr; }
  /// The look whose age the last `step` took over, likewise.
  const Looked* taken_look() const noexcept { return takes_look_ ? &looked_.current() : nullptr; }
  /// What the next `step` takes over, of a planner that does not work by itself.
  void give(Answer answer) { answers_.put(std::move(answer)); }
  void give(Looked look) { looked_.put(look); }

 private:
  static constexpr double usual_progress = 0.0202;  // [rad | m] within the patience, below which the arm is stuck

  /// What the loop tells the planner.
  struct State {
    Eigen::VectorXd q, v, goal;
    double time = 0.0, station = 0.0;
    std::uint64_t goal_number = 0;   // 0: none
    std::uint64_t route_number = 0;  // that it follows
    std::uint64_t stops = 0;         // how often the arm was stuck on the way to this goal
    std::chrono::steady_clock::time_point written{};
  };

  void run();
  void look(const State& state);
  /// The same; what is thrown costs this look alone, not the process.
  void look_safely(const State& state) noexcept;
  void search(const State& state, const Obstacles& obstacles);
  /// Whether the rest of the path from a station on is still free.
  bool ahead_is_free(double station, const Obstacles& obstacles, BodyClearance::Workspace& w) const;
  /// Whether something new blocks the first path, while a better one is made from it.
  bool overtaken();
  /// Whether the straight edge to the reference is free, or else finds back to the path, which begins where it is then.
  bool holds_on(const State& state, const Obstacles& obstacles);
  void follow(const State& state, const Eigen::MatrixXd& path, const Obstacles& obstacles, bool measured);
  Eigen::VectorXd on_route(double station) const;
  Eigen::Index waypoint_after(double station) const;
  Eigen::VectorXd within_limits(const Eigen::VectorXd& q) const { return body_.robot().limits().nearest_within(q); }
  void answer(const State& state, PlanStatus status);

  BodyClearance body_;
  OnlinePlannerConfig settings_;

  // Of the loop.
  Eigen::VectorXd goal_, last_q_, velocity_;
  std::uint64_t goal_number_ = 0;
  double begin_ = 0.0, last_time_ = 0.0, next_look_ = 0.0;
  bool started_ = false, takes_ = false, takes_look_ = false;
  ProgressMonitor progress_;
  TimedPathFollower follower_;
  std::uint64_t stops_ = 0, followed_ = 0, measured_ = 0;
  double looked_at_ = -std::numeric_limits<double>::infinity();  // time of the newest state that was looked at [s]
  double look_excess_ = 0.0;  // by which that look took longer by the machine's clock than by the steps' [s]
  BodyClearance::Workspace here_;

  // Between the two.
  TripleBuffer<State> states_;
  TripleBuffer<Answer> answers_;
  TripleBuffer<Looked> looked_;
  std::counting_semaphore<> wake_{0};
  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;  // of what follows; the loop never takes it
  std::shared_ptr<const Obstacles> newest_;
  std::uint64_t scene_number_ = 0;
  Plan shown_;
  std::shared_ptr<const TimedPath> shown_route_;
  std::uint64_t shown_route_number_ = 0;
  Counts counts_;

  // Of the planner's thread.
  RrtConnect planner_;
  std::shared_ptr<const Obstacles> obstacles_;  // that it plans among
  std::uint64_t seen_scene_ = 0, seen_goal_ = 0, seen_stops_ = 0, route_number_ = 0, path_number_ = 0, searches_ = 0;
  bool newer_ = false;  // a state was taken that it has not looked at
  bool have_path_ = false, direct_ = false, failed_ = false;
  bool changed_ = false;  // the scene, since the path was last looked at
  bool improving_ = false, overtaken_ = false;
  std::uint64_t watched_scene_ = 0;
  BodyClearance::Workspace watch_;  // as the planner's is in use then
  double margin_, failed_at_ = 0.0;
  PlanStatus status_ = PlanStatus::no_path;
  Eigen::MatrixXd path_;
  Eigen::VectorXd stations_;  // of its waypoints
  Margins path_margins_;
  std::optional<RoundedPath> rounded_;
  std::shared_ptr<const TimedPath> route_;
  std::thread thread_;
};

}  // namespace sidestep
