#pragma once

#include <optional>
#include <string>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/constraints/speed_rows.hpp"
#include "sidestep/constraints/torque_controller.hpp"
#include "sidestep/controller/command.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// Limits of Cartesian speed by the distance to obstacles, at the reference and at the arm.
class SpeedLimiter {
 public:
  SpeedLimiter(const ClearanceQuery& body, const ControllerSettings& settings);

  /// The arm is at `arm`, at q; `reference` is another state, or the same (`apart` false). Writes the command's speed, speed limit and
  /// distance, of which it takes the last distance where the last step had one (`known_before`). The speed limit [m/s] for the path
  /// that is followed; none without these settings.
  std::optional<double> update(const KinematicState& reference, const KinematicState& arm, bool apart, const Eigen::VectorXd& q,
                               const Obstacles& obstacles, bool known_before, Command& command) noexcept;

  /// Rows for the program; null: without these settings.
  const SpeedRows* rows() const noexcept { return settings_.speed_limits ? &rows_ : nullptr; }
  const SpeedRows* rows_of_arm() const noexcept { return settings_.speed_limits ? &arm_rows_ : nullptr; }
  int max_rows() const noexcept { return settings_.speed_limits ? rows_.max_size() : 0; }
  const SpeedRows& frames() const noexcept { return rows_; }
  /// Which frame is slowed, and by what; empty where none is.
  std::string explain(const Command& command, const TorqueSolution& solution, const Obstacles& obstacles) const;

 private:
  const ClearanceQuery& body_;
  ClearanceQuery::Workspace workspace_;
  const ControllerSettings& settings_;
  SpeedRows rows_, arm_rows_;
  int nearest_point_ = -1;  // of obstacles
};

}  // namespace sidestep
