#pragma once

#include <Eigen/Core>
#include <string>

#include "input.hpp"
#include "input_target.hpp"
#include "joint_kinds.hpp"
#include "request.hpp"
#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep {

/// The clock that runs along a trajectory at the rate that limits, errors and obstacles leave.
struct TrajectoryClock {
  double time = 0.0, rate = 0.0, change = 0.0;  // s [s], ds/dt, d²s/dt² [1/s]
  double free = 0.0, seen = -1.0;               // the path is free up to there; it is looked at there
  double allowed = 1.0;                         // the rate that limits, errors and obstacles leave
  double delay = 0.0;                           // behind time, at the end the last [s]
  double clearance = 0.0;                       // Clearance that is asked for [m].
  bool blocked = false;
  ClearanceQuery::Nearest blocker{};
};

/// What following a trajectory remembers from one step to the next, whatever body the arm has.
struct TrajectoryMemory {
  explicit TrajectoryMemory(Eigen::Index nv);

  TrajectoryClock clock;
  Eigen::VectorXd begin_q, begin_v;        // State of the reference where it began.
  Eigen::VectorXd path_q, path_v, path_a;  // Path at the clock, at full speed.
  Eigen::Index farthest = 0;               // joint that is farthest from it
};

/// Follows a trajectory by a clock: with ω of the settings,
///   q̈ = q̈_path + 2 ω (q̇_path + v_back − q̇),   v_back = min(ω |e| / 2, √(a |e|)) sign(e),   e = q_path − q.
class TrajectoryFollower : private TrajectoryMemory {
 public:
  TrajectoryFollower(const ClearanceQuery& body, const JointLimits& limits, const JointKinds& joints,
                     const ControllerSettings& settings, const UsableLimits& usable);

  /// The request begins where the reference is.
  void begin(TrajectoryRequest& request, const Reference& reference) noexcept;
  /// Writes to `target` what the request, `age` [s] old, asks of the reference; false once a trajectory that steers has ended: its
  /// end is a goal like others from then on. `pace`: share of the rate, in [0, 1].
  bool follow(const TrajectoryRequest& request, double age, double pace, const Reference& reference, const Obstacles& obstacles,
              const Tick& tick, InputTarget& target) noexcept;
  /// The motion begins anew: the trajectory goes on from where its clock is.
  void begin_anew() noexcept;
  /// Where the reference is beside the trajectory: largest deviation of a joint [rad | m].
  double judge_deviation(const TrajectoryRequest& request, const Eigen::VectorXd& q) noexcept;
  /// Goes on from the follower of another body: the path is looked at anew.
  void go_on_from(const TrajectoryFollower& before) noexcept;

  double time() const noexcept { return clock.time; }
  double rate() const noexcept { return clock.rate; }
  double delay() const noexcept { return clock.delay; }
  bool has_ended(const TrajectoryRequest& request) const noexcept { return !(clock.time < request.path.duration()); }
  const Eigen::VectorXd& begin_position() const noexcept { return begin_q; }
  const Eigen::VectorXd& begin_velocity() const noexcept { return begin_v; }
  const Eigen::VectorXd& path_velocity() const noexcept { return path_v; }
  /// Whether the clock is slower than the trajectory by more than counts as following it.
  bool is_slowed() const noexcept;
  /// Whether that deviation is more than counts as following it.
  bool is_off(double deviation) const noexcept;
  /// How far behind, how far off, and what blocks the path ahead of one that keeps its path; empty where nothing.
  std::string explain(double delay, double deviation, bool keeps_path, const Obstacles& obstacles) const;

 private:
  /// The rate at which the reference moves along the path at s already, or which it has at once.
  double starting_rate(const JointTrajectory& path, double s, const Eigen::VectorXd& v) noexcept;
  void run_clock(const TrajectoryRequest& request, double age, double pace, const Reference& reference,
                 const Obstacles& obstacles, const Tick& tick) noexcept;
  /// Largest change of the rate [1/s], of that change [1/s²], and largest lag of a joint [rad].
  struct Agility {
    double change, change_rate, lag;
  };
  Agility agility(const Eigen::VectorXd& q) const noexcept;
  void set_change(double allowed, const Agility& agility, double period) noexcept;
  /// Looks at the path up to `window` [s] ahead, some places in each step; `first`: the step that takes the request.
  void look_along(const JointTrajectory& path, double window, bool first, const Obstacles& obstacles) noexcept;
  /// The last place, in steps from `begin` up to `end` [s], up to which no point of the arm moves by as much as `distance_left` [m].
  double last_free(const JointTrajectory& path, double begin, double end, double distance_left) noexcept;

  const ClearanceQuery& body_;
  ClearanceQuery::Workspace workspace_;
  const JointLimits& limits_;
  const JointKinds& joints_;
  const ControllerSettings& settings_;
  const UsableLimits& usable_;
  Eigen::VectorXd seen_q_, seen_v_, seen_a_, last_seen_q_;
  Eigen::VectorXd velocity_, acceleration_;
};

}  // namespace sidestep
