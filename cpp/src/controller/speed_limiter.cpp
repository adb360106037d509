#include "speed_limiter.hpp"

#include <algorithm>
#include <cstdio>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

// Speed of what comes, at most, whatever a new scene seems to say: the speed of walking of ISO 13855 [m/s].
constexpr double walking = 1.6;
// Time ahead by which the pace along a path is slowed: as rows slow the arm, the reference would run ahead and cut corners [s].
constexpr double foresight = 0.1;

}  // namespace

SpeedLimiter::SpeedLimiter(const ClearanceQuery& body, const ControllerSettings& settings)
    : body_(body), workspace_(body), settings_(settings), frames_(body.robot()) {}

std::optional<double> SpeedLimiter::update(const KinematicState& reference, const KinematicState& arm, const Eigen::VectorXd& q,
                                           const Obstacles& obstacles, bool known_before, const Tick& tick,
                                           Command& command) noexcept {
  command.speed = frames_.fastest(arm).speed;
  if (!settings_.speed_limits) {
    command.speed_limit = infinity;
    return std::nullopt;
  }
  const SpeedLimitSettings& limits = *settings_.speed_limits;
  const double far = limits.far_distance, before = known_before ? std::min(command.distance, far) : far;
  const ClearanceQuery::Nearest nearest = body_.nearest_obstacle(q, obstacles, far, workspace_);
  const double now = nearest.clearance, closing = std::clamp(before - now, 0.0, (command.speed + walking) * tick.moved);
  nearest_point_ = nearest.point;
  command.distance = now < far ? now : infinity;
  command.speed_limit = limits.allowed(now);
  const double next = limits.allowed(now - closing * (tick.period / tick.moved));
  const Eigen::VectorXd& most = body_.robot().limits().acceleration;
  at_reference_ = {&reference, &most, command.speed_limit, next};
  at_arm_ = {&arm, &most, command.speed_limit, next};
  return limits.allowed(now - closing / tick.moved * foresight);
}

std::string SpeedLimiter::explain(const Command& command, const MotionSolution& solution, const Obstacles& obstacles) const {
  if (!settings_.speed_limits || solution.speed_frame < 0) {
    return "";
  }
  char limit[32], away[48] = "";
  std::snprintf(limit, sizeof limit, "%.2f m/s", command.speed_limit);
  if (command.distance < infinity) {
    std::snprintf(away, sizeof away, ", %.2f m from ", command.distance);
  }
  const std::string& frame = body_.robot().frames()[static_cast<std::size_t>(solution.speed_frame)].name;
  return (solution.speed_slack > 0.0 ? "faster than the speed limit, which gives way: '" : "slowed by the speed limit: '") +
         frame + "' may move at " + limit + (away[0] == '\0' ? "" : away + obstacles.words_for(nearest_point_)) + "; ";
}

}  // namespace sidestep
