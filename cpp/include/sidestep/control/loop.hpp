#pragma once

#include <Eigen/Core>
#include <atomic>
#include <memory>
#include <utility>

#include "sidestep/control/handover.hpp"
#include "sidestep/control/torque_controller.hpp"
#include "sidestep/dynamical_system/geometric_system.hpp"

namespace sidestep {

/// How a step of the loop ended. The torque is safe to send after every one.
struct LoopStatus {
  StepStatus system;
  TorqueStatus torque;
};

/// The whole control loop: state in, torque out. The acceleration of a GeometricSystem and the clearances it measured go
/// to a TorqueController, whatever the goal is; only where q or v is unusable are there none.
///
/// `step` belongs to one thread, which a `Use` makes sure of, allocates nothing, takes no lock and never throws. Goal and obstacles may be replaced
/// from other threads meanwhile: whatever they need is built there.
class Loop {
 public:
  /// Throws std::invalid_argument if system and controller differ in their number of coordinates.
  Loop(std::shared_ptr<const GeometricSystem> system, TorqueController controller, Goal goal, Obstacles obstacles);

  /// Holds a loop for one thread or run.
  class Use {
   public:
    /// Throws std::runtime_error if it is held already.
    explicit Use(Loop& loop);
    Use(Use&& other) noexcept : loop_(std::exchange(other.loop_, nullptr)) {}
    Use& operator=(Use&&) = delete;
    ~Use() { end(); }
    void end() noexcept {
      if (loop_ != nullptr) {
        std::exchange(loop_, nullptr)->in_use_.store(false, std::memory_order_release);
      }
    }

   private:
    Loop* loop_;
  };

  void set_goal(Goal goal) { goal_.put(std::move(goal)); }
  void set_obstacles(Obstacles obstacles) { obstacles_.put(std::move(obstacles)); }

  /// One period at q [rad | m] and v [/s] (nv), with the mass matrix (nv, nv) and the bias (nv) [Nm | N] there. A size
  /// that is wrong counts as invalid input.
  [[nodiscard]] LoopStatus step(ConstVectorRef q, ConstVectorRef v,
                                Eigen::Ref<const Eigen::MatrixXd> mass_matrix,
                                ConstVectorRef bias) noexcept;

  /// Of the last step: torque [Nm | N] and what was in its way.
  const TorqueSolution& solution() const noexcept { return solution_; }
  const GeometricSystem::Workspace& workspace() const noexcept { return workspace_; }
  const GeometricSystem& system() const noexcept { return *system_; }

 private:
  std::shared_ptr<const GeometricSystem> system_;
  GeometricSystem::Workspace workspace_;
  TorqueController controller_;
  TorqueSolution solution_;
  Handover<Goal> goal_;
  Handover<Obstacles> obstacles_;
  std::atomic<bool> in_use_{false};
};

}  // namespace sidestep
