// Limits of Cartesian speed by the distance to obstacles.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

// What comes is taken to come no faster [m/s], whatever a new scene seems to say: the speed of walking of ISO 13855.
constexpr double walking = 1.6;
// In which the pace along a path is slowed: as rows slow the arm, the reference would run ahead, and corners be cut.
constexpr double foresight = 0.1;  // [s]
constexpr double of_limit = 0.95;  // below that of the rows

}  // namespace

void Controller::Impl::limit_speed() noexcept {
  const KinematicState& state = arm_state();
  command.speed = arm_speed_rows_.fastest(state).speed;
  if (!settings.speed_limits) {
    command.speed_limit = infinity;
    return;
  }
  const SpeedLimitSettings& limits = *settings.speed_limits;
  const double far = limits.far_distance, before = known_before_ ? std::min(command.distance, far) : far;
  const BodyClearance::Nearest nearest = body_.nearest_obstacle(arm_q_, obstacles(), far, here_);
  const double now = nearest.clearance, closing = std::clamp(before - now, 0.0, (command.speed + walking) * settings.period);
  nearest_point_ = nearest.point;
  limit_pace(limits.allowed(now - closing / settings.period * foresight));
  command.distance = now < far ? now : infinity;
  command.speed_limit = limits.allowed(now);
  const double next = limits.allowed(now - closing);
  speed_rows_.update(workspace.state(), arm.robot().limits(), command.speed_limit, next, settings.period);
  if (apart_) {
    arm_speed_rows_.update(state, arm.robot().limits(), command.speed_limit, next, settings.period);
  }
}

void Controller::Impl::limit_pace(double limit) noexcept {
  if (!guide || followed_ != &reference_) {
    return;
  }
  leader_.update(arm.robot(), path_reference_.position, path_reference_.velocity);
  const double speed = speed_rows_.fastest(leader_).speed, pace = guide->following().follower.pace;
  guide->limit_pace(std::min(pace_, pace > 0.0 && speed > of_limit * limit * pace ? of_limit * limit * pace / speed : 1.0));
}

std::string Controller::Impl::explain_speed() const {
  if (!settings.speed_limits || solution.speed_frame < 0) {
    return "";
  }
  char limit[32], away[48] = "";
  std::snprintf(limit, sizeof limit, "%.2f m/s", command.speed_limit);
  if (command.distance < infinity) {
    std::snprintf(away, sizeof away, ", %.2f m from ", command.distance);
  }
  const std::string& frame = arm.robot().frames()[static_cast<std::size_t>(solution.speed_frame)].name;
  return (solution.speed_slack > 0.0 ? "faster than the speed limit, which gives way: '" : "slowed by the speed limit: '") +
         frame + "' may move at " + limit + (away[0] == '\0' ? "" : away + obstacles().words_for(nearest_point_)) + "; ";
}

}  // namespace sidestep
