#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "sidestep/attractor/goal.hpp"

namespace sidestep {

/// A configuration for a pose goal.
struct Posture {
  Eigen::VectorXd q;            ///< (nv) [rad | m]
  double position_error;        ///< distance of the farthest frame from its goal [m]
  double rotation_error;        ///< angle between them [rad]; 0 where the orientation is free
  double clearance = 0.0;       ///< [m] as the search was told; less than zero: something is in the way
  bool touches_itself = false;  ///< the arm does, here and at all others with the pose that the search found

  /// Whether the frame is at the pose, to 1e-7.
  bool found() const noexcept;
};

/// How far the farthest frame of a pose goal is: distance [m] and angle [rad], 0 where the orientation is free. No allocation.
struct PoseError {
  double position, rotation;
};
PoseError pose_error(const PoseGoal& goal, const KinematicState& state) noexcept;

struct PostureSearchSettings {
  int starts = 40;          ///< configurations that it begins from, at most
  std::uint64_t seed = 0;   ///< of those that are random
  bool another = false;     ///< not from the configuration near by, where the posture found from there leads nowhere
  double clearance = 0.01;  ///< [m] with so much the first posture is good enough; else that with most is taken
  /// [rad | m] kept from position limits where that can be; at most a twentieth of a joint's range
  double limit_distance = 0.0;
};

/// A configuration within the limits with the frame at the pose, by damped least squares from q = near:
///
///     q ← clip(q + Jᵀ (J Jᵀ + λ² I)⁻¹ e),     e = (p* − p, log(R* Rᵀ)),
///
/// λ shrinking with the error (Nakamura and Hanafusa 1986). Where that does not get there, or to one with little
/// `settings.clearance`, again from random configurations ever farther away; the same every time for one seed. A pose that is reached
/// at position limits alone gets a posture there. Without success the nearest that was found.
Posture find_posture(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near,
                     const PostureSearchSettings& settings, const std::function<double(const Eigen::VectorXd&)>& clearance_at);

}  // namespace sidestep
