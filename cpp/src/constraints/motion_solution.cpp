#include "sidestep/constraints/motion_solution.hpp"

#include "../math/settings.hpp"

namespace sidestep {

const char* name(TorqueStatus status) noexcept {
  switch (status) {
    case TorqueStatus::ok: return "ok";
    case TorqueStatus::limited: return "limited";
    case TorqueStatus::relaxed: return "relaxed";
    case TorqueStatus::relaxed_safety: return "relaxed_safety";
    case TorqueStatus::clearance_lost: return "clearance_lost";
    case TorqueStatus::fallback_invalid_input: return "fallback_invalid_input";
    case TorqueStatus::fallback_solver: return "fallback_solver";
  }
  return "unknown";
}

const char* name(TorqueFault fault) noexcept {
  switch (fault) {
    case TorqueFault::none: return "none";
    case TorqueFault::position: return "position";
    case TorqueFault::velocity: return "velocity";
    case TorqueFault::acceleration: return "acceleration";
    case TorqueFault::mass_matrix: return "mass_matrix";
    case TorqueFault::bias: return "bias";
    case TorqueFault::clearances: return "clearances";
  }
  return "unknown";
}

TorqueSolution::TorqueSolution(int num_coordinates, int max_safety_rows)
    : torque(Eigen::VectorXd::Zero(num_coordinates)),
      acceleration(Eigen::VectorXd::Zero(num_coordinates)),
      slack(Eigen::VectorXd::Zero(num_coordinates)),
      lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      active(static_cast<std::size_t>(num_coordinates), Limit::none),
      safety(static_cast<std::size_t>(max_safety_rows)) {}

}  // namespace sidestep
