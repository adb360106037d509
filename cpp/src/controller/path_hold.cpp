#include "path_hold.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace sidestep {

void hold_to_path(const ControllerSettings& settings, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                  JointGoal& goal) noexcept {
  const double w = settings.inputs.frequency, K = settings.barriers.stiffness, D = settings.barriers.damping;
  goal.acceleration += std::max(0.0, w * w - K) * (goal.position - q) + std::max(0.0, 2.0 * w - D) * (goal.velocity - v);
}

LookAhead::Leader leader_along(const ControllerSettings& settings, JointTrajectory path, double clock, double rate) {
  return [&settings, path = std::make_shared<const JointTrajectory>(std::move(path)), clock, rate](
             const Eigen::VectorXd& q, const Eigen::VectorXd& v, double duration, Goal& goal) mutable {
    JointGoal& reference = std::get<JointGoal>(goal);
    clock += rate * duration;
    path->sample(clock, reference.position, reference.velocity, reference.acceleration);
    reference.velocity *= rate;
    reference.acceleration *= rate * rate;
    hold_to_path(settings, q, v, reference);
  };
}

LookAhead::Leader leader_along(const ControllerSettings& settings, const OnlinePlanner& planner,
                               const OnlinePlanner::Following& following) {
  const std::shared_ptr<const TimedPath> route = planner.route(following.route_number);
  if (route == nullptr) {
    return {};
  }
  return [&settings, route, follower = following.follower, route_settings = planner.settings().planner.route](
             const Eigen::VectorXd& q, const Eigen::VectorXd& v, double duration, Goal& goal) mutable {
    JointGoal& reference = std::get<JointGoal>(goal);
    follower.advance(*route, route_settings, q, duration, reference.position, reference.velocity, reference.acceleration);
    hold_to_path(settings, q, v, reference);
  };
}

}  // namespace sidestep
