#include "sidestep/constraints/motion_solution.hpp"

#include "../math/settings.hpp"

namespace sidestep {

const char* name(ProgramStatus status) noexcept {
  switch (status) {
    case ProgramStatus::ok: return "ok";
    case ProgramStatus::limited: return "limited";
    case ProgramStatus::relaxed: return "relaxed";
    case ProgramStatus::relaxed_safety: return "relaxed_safety";
    case ProgramStatus::clearance_lost: return "clearance_lost";
    case ProgramStatus::fallback_invalid_input: return "fallback_invalid_input";
    case ProgramStatus::fallback_solver: return "fallback_solver";
  }
  return "unknown";
}

const char* name(ProgramFault fault) noexcept {
  switch (fault) {
    case ProgramFault::none: return "none";
    case ProgramFault::position: return "position";
    case ProgramFault::velocity: return "velocity";
    case ProgramFault::acceleration: return "acceleration";
    case ProgramFault::mass_matrix: return "mass_matrix";
    case ProgramFault::bias: return "bias";
    case ProgramFault::clearances: return "clearances";
  }
  return "unknown";
}

MotionSolution::MotionSolution(int num_coordinates, int max_safety_rows)
    : torque(Eigen::VectorXd::Zero(num_coordinates)),
      acceleration(Eigen::VectorXd::Zero(num_coordinates)),
      slack(Eigen::VectorXd::Zero(num_coordinates)),
      lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      active(static_cast<std::size_t>(num_coordinates), Limit::none),
      safety(static_cast<std::size_t>(max_safety_rows)) {}

}  // namespace sidestep
