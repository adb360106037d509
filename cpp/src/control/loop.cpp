#include "sidestep/control/loop.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace sidestep {

Loop::Loop(std::shared_ptr<const GeometricSystem> system, TorqueController controller, Goal goal, Obstacles obstacles)
    : system_(std::move(system)),
      workspace_(*system_),
      controller_(std::move(controller)),
      solution_(controller_.num_coordinates(), controller_.settings().safety.max_rows),
      goal_(std::move(goal)),
      obstacles_(std::move(obstacles)) {
  if (controller_.num_coordinates() != system_->robot().num_coordinates()) {
    throw std::invalid_argument("loop: the controller has " + std::to_string(controller_.num_coordinates()) +
                                " coordinates, the system " + std::to_string(system_->robot().num_coordinates()));
  }
}

Loop::Use::Use(Loop& loop) : loop_(&loop) {
  if (loop.in_use_.exchange(true, std::memory_order_acquire)) {
    throw std::runtime_error(
        "the loop is in use: a RealTimeRun or another thread steps it; wait for its end (finish) or stop it first");
  }
}

LoopStatus Loop::step(ConstVectorRef q, ConstVectorRef v,
                      Eigen::Ref<const Eigen::MatrixXd> mass_matrix, ConstVectorRef bias) noexcept {
  const Goal& goal = goal_.get();
  const Obstacles& obstacles = obstacles_.get();
  const Eigen::Index nv = controller_.num_coordinates();
  if (q.size() != nv || v.size() != nv) {
    workspace_.acceleration.setZero();
    return {StepStatus::invalid_state, controller_.solve(q, v, workspace_.acceleration, mass_matrix, bias, solution_)};
  }
  const StepStatus status = system_->acceleration(q, v, goal, obstacles, workspace_);
  // Where the state is unusable nothing was measured.
  const Clearances* clearances = status == StepStatus::invalid_state ? nullptr : &workspace_.clearances;
  return {status,
          controller_.solve(q, v, workspace_.acceleration, mass_matrix, bias, clearances, solution_)};
}

}  // namespace sidestep
