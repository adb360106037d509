#include "look_ahead_follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sidestep {
namespace {

constexpr int periods_late = 1000;  // periods by which a trajectory is moved on at once, at most

AvoidanceTrajectory at_rest(const Robot& robot) {
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(robot.num_coordinates());
  return AvoidanceTrajectory(robot.limits(), q, q, q);
}

std::unique_ptr<LookAhead> make_look_ahead(std::shared_ptr<const GeometricSystem> system, const ControllerSettings& settings,
                                           const std::optional<RigidBodyDynamics>& dynamics) {
  if (!settings.look_ahead) {
    return nullptr;
  }
  LookAheadSettings look = *settings.look_ahead;
  look.seed = settings.seed;
  return std::make_unique<LookAhead>(std::move(system), look, dynamics);
}

}  // namespace

LookAheadMemory::LookAheadMemory(const Robot& robot)
    : trajectory(at_rest(robot)), goal(JointGoal(Eigen::VectorXd::Zero(robot.num_coordinates()))) {}

LookAheadFollower::LookAheadFollower(std::shared_ptr<const GeometricSystem> system, const ControllerSettings& settings,
                                     const std::optional<RigidBodyDynamics>& dynamics)
    : LookAheadMemory(system->robot()),
      settings_(settings),
      look_ahead_(make_look_ahead(std::move(system), settings, dynamics)),
      buffer_(FoundTrajectory{0.0, 0, false, trajectory}) {}

void LookAheadFollower::take(const AvoidanceTrajectory* found) noexcept {
  avoiding = found != nullptr;
  if (avoiding) {
    trajectory = *found;
    write_goal();
  }
}

const FoundTrajectory* LookAheadFollower::follow(const Tick& tick) noexcept {
  const double time = tick.time;
  if (avoiding) {
    trajectory.advance(tick.held);
  }
  const bool taken = buffer_.update();
  pending_ = taken || pending_;
  const FoundTrajectory& found = buffer_.current();
  if (taken) {
    pending_excess = std::max(0.0, found.duration - (time - found.time));
  }
  const double late = time - (found.time + settings_.look_ahead->delay);
  if (pending_ && late > -0.5 * settings_.period) {
    pending_ = false;
    looked_at = found.time;
    look_excess = pending_excess;
    avoiding = found.avoid;
    if (avoiding) {
      trajectory = found.trajectory;
      const int periods = std::min(periods_late, static_cast<int>(std::lround(late / settings_.period)));
      for (int k = 0; k < periods; ++k) {
        trajectory.advance(settings_.period);
      }
    }
  }
  if (avoiding) {
    write_goal();
  }
  return taken ? &found : nullptr;
}

void LookAheadFollower::judge_age(double time, bool has_movers) noexcept {
  age_ = look_ahead_ ? time - looked_at + look_excess : 0.0;
  // Where nothing moves near the arm, a look-ahead has nothing to say; and the way out of the way is not slowed.
  pace = look_ahead_ && has_movers && !avoiding ? settings_.look_ahead->pace(age_) : 1.0;
}

void LookAheadFollower::go_on_from(const LookAheadFollower& before) {
  static_cast<LookAheadMemory&>(*this) = before;
  if (avoiding && look_ahead_ && settings_.synchronous) {
    look_ahead_->resume(trajectory);
  }
}

}  // namespace sidestep
