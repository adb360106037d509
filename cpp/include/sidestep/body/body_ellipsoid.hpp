#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// A covering ellipsoid {y : (y − mean)ᵀ shape⁻¹ (y − mean) ≤ 1} of a link, in the frame of the joint's child, or in
/// the world where `joint` is −1. With support s(n) = √(nᵀ shape n): its half-width along a unit vector n.
struct BodyEllipsoid {
  int joint;
  int component;  ///< Index of the component of the body.
  Eigen::Vector3d mean;
  Eigen::Matrix3d shape;  ///< Shape matrix, level · covariance [m²].
  double extent;          ///< Longest semi-axis [m]: radius of a ball around it.
};

/// The ellipsoids of a calibrated body, those of one joint together in the order of the joints.
/// Throws std::invalid_argument if the body has no levels or a link is unknown; `owner` begins the message.
std::vector<BodyEllipsoid> body_ellipsoids(const Robot& robot, const Body& body, const char* owner);

/// How a joint's child moves; the world, at rest, for joint −1.
const KinematicState::Link& link_or_world(const KinematicState& state, int joint) noexcept;

/// Velocity and, at q̈ = 0, acceleration of the body-fixed point now at p (world).
struct PointMotion {
  Eigen::Vector3d velocity, acceleration;
};
PointMotion point_motion(const KinematicState::Link& link, const Eigen::Vector3d& p) noexcept;

}  // namespace sidestep
