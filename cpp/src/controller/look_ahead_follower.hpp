#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "reference.hpp"
#include "tick.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/math/triple_buffer.hpp"
#include "sidestep/planning/avoidance_trajectory.hpp"
#include "sidestep/planning/look_ahead.hpp"

namespace sidestep {

/// What a look-ahead in another thread found, to follow from `time` + delay on.
struct FoundTrajectory {
  double time = 0.0;
  std::uint64_t request_number = 0;
  bool avoid = false;
  AvoidanceTrajectory trajectory;
  double duration = 0.0;  // Time from the state to the result, by the machine's clock [s].
};

/// What following the look-ahead remembers from one step to the next, whatever body the arm has.
struct LookAheadMemory {
  explicit LookAheadMemory(const Robot& robot);

  bool avoiding = false;
  double looked_at = 0.0;       // time of the state that the look-ahead which is followed began with [s]
  double look_excess = 0.0;     // time that look took by the machine's clock beyond the steps' [s]
  double pending_excess = 0.0;  // the same of the one that is followed next [s]
  double pace = 1.0;            // share of its speed that the look-ahead's age leaves the arm
  AvoidanceTrajectory trajectory;
  Goal goal;  // JointGoal: the target of the trajectory
};

/// Follows the trajectories by which the look-ahead leads the arm out of the way of what moves.
class LookAheadFollower : private LookAheadMemory {
 public:
  LookAheadFollower(std::shared_ptr<const GeometricSystem> system, const ControllerSettings& settings,
                    const std::optional<RigidBodyDynamics>& dynamics);

  /// In a synchronous controller: looks where it is due. `leader()` moves the goal along its path; it is asked for at a look alone.
  template <class MakeLeader>
  void pursue(const Goal& followed, const Reference& reference, const Obstacles& obstacles, const Tick& tick,
              MakeLeader&& leader) {
    if (look_ahead_) {
      const bool due = look_ahead_->is_due(tick.held);
      take(look_ahead_->pursue(followed, reference.q, reference.v, obstacles, tick.held, due ? leader() : LookAhead::Leader()));
    }
  }
  /// Otherwise: moves on to now, and takes over what the worker found once it is due. Returns what was taken; null: nothing.
  const FoundTrajectory* follow(const Tick& tick) noexcept;
  /// How old the look-ahead is, and the pace that it leaves beside what moves (`has_movers`).
  void judge_age(double time, bool has_movers) noexcept;
  /// The motion begins anew.
  void begin_anew() noexcept { avoiding = pending_ = false; }
  void go_on_from(const LookAheadFollower& before);

  bool is_on() const noexcept { return look_ahead_ != nullptr; }
  LookAhead& look_ahead() noexcept { return *look_ahead_; }
  bool is_followed() const noexcept { return avoiding; }
  const AvoidanceTrajectory& followed() const noexcept { return trajectory; }
  /// The target of the trajectory, for the barriers.
  const Goal& target() const noexcept { return goal; }
  double current_pace() const noexcept { return pace; }
  /// Whether its age slows an arm that moves.
  bool slows(bool moves) const noexcept { return pace < 1.0 && moves; }
  double age() const noexcept { return age_; }  ///< [s]
  TripleBuffer<FoundTrajectory>& buffer() noexcept { return buffer_; }

 private:
  void take(const AvoidanceTrajectory* found) noexcept;
  void write_goal() noexcept { std::get<JointGoal>(goal).position = trajectory.target(); }

  const ControllerSettings& settings_;
  std::unique_ptr<LookAhead> look_ahead_;  // null: off
  TripleBuffer<FoundTrajectory> buffer_;
  bool pending_ = false;  // a trajectory was taken over, and is not followed yet
  double age_ = 0.0;
};

}  // namespace sidestep
