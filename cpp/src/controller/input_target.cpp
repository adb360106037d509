#include "input_target.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {

InputTarget::InputTarget(const JointLimits& limits, const ControllerSettings& settings)
    : limits_(limits),
      settings_(settings),
      motion_(JointGoal(Eigen::VectorXd::Zero(limits.lower.size()))),
      attraction_(motion_),
      desired_acceleration_(Eigen::VectorXd::Zero(limits.lower.size())) {}

void InputTarget::accelerate(const Reference& reference, const Eigen::VectorXd& velocity,
                             const Eigen::VectorXd& acceleration) noexcept {
  JointGoal& goal = std::get<JointGoal>(attraction_);
  goal.position = reference.q.cwiseMax(limits_.lower).cwiseMin(limits_.upper);
  for (Eigen::Index j = 0; j < velocity.size(); ++j) {
    const double now = reference.v[j], change = velocity[j] - now;
    const double braking = change * now < 0.0 ? std::copysign(std::min(std::abs(change), std::abs(now)), change) : 0.0;
    goal.velocity[j] = now + braking;
    goal.acceleration[j] = acceleration[j] - settings_.barriers.damping * braking;
  }
  desired_acceleration_ = acceleration;
  is_followed_ = true;
}

void InputTarget::respond(const Reference& reference, const Eigen::VectorXd& acceleration) noexcept {
  JointGoal& goal = std::get<JointGoal>(attraction_);
  goal.position = std::get<JointGoal>(motion_).position;
  goal.velocity = reference.v + acceleration / settings_.barriers.damping;
  goal.acceleration.setZero();
  is_followed_ = true;
}

void InputTarget::go_on_from(const InputTarget& before) noexcept {
  motion_ = before.motion_;
  attraction_ = before.attraction_;
  desired_acceleration_ = before.desired_acceleration_;
  is_followed_ = before.is_followed_;
  waits_ = before.waits_;
}

}  // namespace sidestep
