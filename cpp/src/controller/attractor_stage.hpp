#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "closing_estimate.hpp"
#include "reference.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/planning/avoidance_trajectory.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// What the reference is led by in a step.
struct Lead {
  const Goal& goal;                      // Goal of the attractor.
  AvoidanceTrajectory const* avoidance;  // Trajectory that takes the place of its attraction; null: none.
  const Eigen::VectorXd* kept_path;      // the acceleration of a path that is kept, in place of it; null: none
  double pace = 1.0;                     // share of its speed that the arm has, in [0, 1]
  bool rests = false;                    // the arm stops
};

/// Stage `attractor`: the acceleration that the goal and the curved space want, at the reference; and the clearances there and at
/// the arm.
class AttractorStage {
 public:
  AttractorStage(std::shared_ptr<const GeometricSystem> system, const ControllerSettings& settings);

  /// Writes the wanted acceleration of the reference among the obstacles.
  StepStatus attract(const Lead& lead, const Reference& reference, const Obstacles& obstacles, const ClosingEstimate& closing,
                     Eigen::VectorXd& wanted) noexcept;
  /// The clearances of the arm, where it is not exactly where the reference is; false where they are unusable.
  bool look_at_arm(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Obstacles& obstacles,
                   const ClosingEstimate& closing) noexcept;
  /// The clearances at the reference alone, as a step has left them.
  void look_at_reference(const Reference& reference, const Goal& goal, const Obstacles& obstacles) noexcept;

  /// Clearances of the last `attract` and of the last `look_at_arm`, with the closings that nobody told.
  const Clearances& clearances() const noexcept { return *clearances_; }
  const Clearances& arm_clearances() const noexcept { return *arm_clearances_; }

  const GeometricSystem& system() const noexcept { return *system_; }
  const GeometricSystem::Workspace& at_reference() const noexcept { return reference_; }
  const GeometricSystem::Workspace& at_arm() const noexcept { return arm_; }
  Eigen::VectorXd& activations() noexcept { return reference_.activations; }

 private:
  /// Leaves out the push out of what is in doubt, where nothing else asks for one.
  void wait_in_doubt(const ClosingEstimate& closing, Eigen::VectorXd& wanted) const noexcept;

  const std::shared_ptr<const GeometricSystem> system_;
  const ControllerSettings& settings_;
  GeometricSystem::Workspace reference_, arm_;
  Clearances corrected_, arm_corrected_;  // Memory for clearances that closings change.
  const Clearances *clearances_, *arm_clearances_;
};

}  // namespace sidestep
