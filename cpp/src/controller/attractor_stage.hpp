#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "closing_estimate.hpp"
#include "reference.hpp"
#include "tick.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/planning/avoidance_trajectory.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// What leads the reference in a step.
struct Lead {
  const Goal& goal;                      // Goal of the attractor.
  AvoidanceTrajectory const* avoidance;  // Trajectory that takes the place of its attraction; null: none.
  const Eigen::VectorXd* kept_path;      // Acceleration of a path that is kept, in place of it; null: none.
  double pace = 1.0;                     // Share of its speed that the arm may use, in [0, 1].
  bool rests = false;                    // The arm stops.
};

/// Stage `attractor`: the acceleration that the goal and the curved space want, at the reference; and the clearances there and at
/// the arm.
class AttractorStage {
 public:
  AttractorStage(std::shared_ptr<const GeometricSystem> system, const ControllerSettings& settings);

  /// Writes the wanted acceleration of the reference among the obstacles; `activations`: see ActivationDistances.
  StepStatus attract(const Lead& lead, const Eigen::VectorXd& activations, const Reference& reference,
                     const Obstacles& obstacles, const ClosingEstimate& closing, const Tick& tick,
                     Eigen::VectorXd& wanted) noexcept;
  /// Evaluates the clearances of the arm, which is not exactly where the reference is; false if they are unusable.
  bool look_at_arm(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Obstacles& obstacles,
                   const ClosingEstimate& closing) noexcept;
  /// Evaluates the clearances at the reference, after another arm has taken over.
  void look_at_reference(const Reference& reference, const Goal& goal, const Obstacles& obstacles) noexcept;

  /// Clearances of the last `attract` and of the last `look_at_arm`, with the closings that nobody told.
  const Clearances& clearances() const noexcept { return *clearances_; }
  const Clearances& arm_clearances() const noexcept { return *arm_clearances_; }

  const GeometricSystem& system() const noexcept { return *system_; }
  const GeometricSystem::Workspace& at_reference() const noexcept { return reference_; }
  const GeometricSystem::Workspace& at_arm() const noexcept { return arm_; }

 private:
  /// Writes the acceleration that stops a velocity as fast as the limits of acceleration and jerk allow.
  void write_braking(const Eigen::VectorXd& v, Eigen::VectorXd& wanted) const noexcept;
  /// Removes the recovery from obstacles that are in doubt, if nothing else needs it.
  void wait_in_doubt(const ClosingEstimate& closing, Eigen::VectorXd& wanted) const noexcept;

  const std::shared_ptr<const GeometricSystem> system_;
  const ControllerSettings& settings_;
  GeometricSystem::Workspace reference_, arm_;
  Clearances corrected_, arm_corrected_;  // Memory for clearances that closings change.
  const Clearances *clearances_, *arm_clearances_;
};

}  // namespace sidestep
