#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "sidestep/dynamical_system/goal.hpp"

namespace sidestep {

/// A configuration for a pose goal.
struct Posture {
  Eigen::VectorXd q;      ///< (nv) [rad | m]
  double position_error;  ///< distance of the frame from the goal [m]
  double rotation_error;  ///< angle between them [rad]; 0 where the orientation is free
  bool free = true;       ///< as far as the search was told

  /// Whether the frame is at the pose, to 1e-7.
  bool found() const noexcept;
};

/// How far a frame is from a pose goal: distance [m] and angle [rad], 0 where the orientation is free. No allocation.
struct PoseError {
  double position, rotation;
};
PoseError pose_error(const PoseGoal& goal, const KinematicState& state) noexcept;

/// A configuration within the limits with the frame at the pose, by damped least squares from q = near:
///
///     q ← clip(q + Jᵀ (J Jᵀ + λ² I)⁻¹ e),     e = (p* − p, log(R* Rᵀ)),
///
/// λ shrinking with the error (Nakamura and Hanafusa 1986). Where that does not get there, or to one that is not `free`, again
/// from random configurations ever farther away, up to `starts` in all; the same every time for one seed. Without success
/// one that is not free, else the nearest that was found.
Posture find_posture(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near, int starts, std::uint64_t seed,
                     const std::function<bool(const Eigen::VectorXd&)>& free);

}  // namespace sidestep
