#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "sidestep/body/cover_refinement.hpp"
#include "sidestep/model/arm.hpp"

namespace sidestep {

/// An object that a link holds: a tool, something grasped. It is part of the arm: it keeps off obstacles and off the links
/// that another joint moves, and its mass counts.
struct Attachment {
  std::string name;                                        ///< of its frame, which no other frame may have
  std::string link;                                        ///< that holds it
  Eigen::Isometry3d X_LA = Eigen::Isometry3d::Identity();  ///< its pose in the link's frame
  SolidEllipsoids cover;                                   ///< ellipsoids that hold all of it, in its own frame
  Inertial inertial;                                       ///< in its own frame; mass 0: unknown, or none
  std::vector<std::string> may_touch;                      ///< links that get no clearance from it, as the fingers
};

/// The arm with an object attached: a frame, ellipsoids, pairs with every covered link that another joint moves, and its inertia
/// with that of the link.
/// At q (nv), where it is not empty, the object is apart from everything: a pair whose ellipsoids overlap there may stay as near as
/// it is (LinkPair::contact), less `attached_room` [m].
/// Throws std::invalid_argument that names the object and what is wrong: a name that is taken, a link that is unknown or that no
/// joint moves, no ellipsoid or one that is none, an inertia that is none.
Arm attach(const Arm& arm, const Attachment& object, const Eigen::VectorXd& q = {});

constexpr double attached_room = 0.001;

}  // namespace sidestep
