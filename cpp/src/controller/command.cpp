#include "sidestep/controller/command.hpp"

namespace sidestep {

const char* to_string(SafetyStatus status) noexcept {
  switch (status) {
    case SafetyStatus::ok: return "ok";
    case SafetyStatus::limited: return "limited";
    case SafetyStatus::relaxed: return "relaxed";
    case SafetyStatus::margin_lost: return "margin_lost";
    case SafetyStatus::tracking_lost: return "tracking_lost";
    case SafetyStatus::stale: return "stale";
    case SafetyStatus::stopping: return "stopping";
    case SafetyStatus::clearance_lost: return "clearance_lost";
  }
  return "unknown";
}

const char* to_string(Activity activity) noexcept {
  switch (activity) {
    case Activity::no_goal: return "no_goal";
    case Activity::moving: return "moving";
    case Activity::waiting: return "waiting";
    case Activity::arrived: return "arrived";
    case Activity::blocked: return "blocked";
    case Activity::stale: return "stale";
  }
  return "unknown";
}

Command::Command(int num_coordinates)
    : torque(Eigen::VectorXd::Zero(num_coordinates)),
      torque_without_gravity(torque),
      wanted(torque),
      acceleration(torque),
      velocity(torque),
      position(Eigen::VectorXd::Constant(num_coordinates, std::numeric_limits<double>::quiet_NaN())),
      observed{torque, torque},
      input_change(torque),
      limits(static_cast<std::size_t>(num_coordinates), Limit::none) {}

}  // namespace sidestep
