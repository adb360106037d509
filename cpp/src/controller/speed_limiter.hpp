#pragma once

#include <optional>
#include <string>

#include "tick.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/constraints/speed_constraint.hpp"
#include "sidestep/controller/command.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// Limits of Cartesian speed by the distance to obstacles, at the reference and at the arm.
class SpeedLimiter {
 public:
  SpeedLimiter(const ClearanceQuery& body, const ControllerSettings& settings);

  /// The arm is at `arm`, at q; `reference` is another state, or the same. Writes the command's speed, speed limit and
  /// distance, of which it takes the last distance where the last step had one (`known_before`). The speed limit [m/s] for the path
  /// that is followed; none without these settings.
  std::optional<double> update(const KinematicState& reference, const KinematicState& arm, const Eigen::VectorXd& q,
                               const Obstacles& obstacles, bool known_before, const Tick& tick, Command& command) noexcept;

  /// Limits for the program at either state; none without these settings.
  const SpeedLimitNow& at_reference() const noexcept { return at_reference_; }
  const SpeedLimitNow& at_arm() const noexcept { return at_arm_; }
  const FrameSpeeds& frames() const noexcept { return frames_; }
  /// Which frame is slowed, and by what; empty where none is.
  std::string explain(const Command& command, const MotionSolution& solution, const Obstacles& obstacles) const;

 private:
  const ClearanceQuery& body_;
  ClearanceQuery::Workspace workspace_;
  const ControllerSettings& settings_;
  FrameSpeeds frames_;
  SpeedLimitNow at_reference_, at_arm_;
  int nearest_point_ = -1;  // Nearest obstacle point.
};

}  // namespace sidestep
