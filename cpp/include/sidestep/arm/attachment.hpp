#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "sidestep/body/cover_refinement.hpp"
#include "sidestep/arm/arm.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// An object that a link holds: a tool, or something grasped. It becomes part of the arm: it avoids obstacles and the links
/// that other joints move, and its mass counts.
struct Attachment {
  std::string name;                                        ///< Name of its frame, which no other frame may have.
  std::string link;                                        ///< Link that holds it.
  Eigen::Isometry3d X_LA = Eigen::Isometry3d::Identity();  ///< Its pose in the link's frame.
  SolidEllipsoids cover;                                   ///< Ellipsoids that hold all of it, in its own frame.
  Inertial inertial;                                       ///< Mass properties in its own frame; mass 0: unknown, or none.
  std::vector<std::string> may_touch;                      ///< Links that get no clearance from it, such as the fingers.
  std::vector<std::string> rests_on;  ///< Names of obstacles that it stands on until it is lifted; or `anything`.

  static constexpr const char* anything = "*";  // Stands in `rests_on` for every obstacle.
};

/// The arm with an object attached: adds a frame, ellipsoids, pairs with every covered link that another joint moves, and its
/// inertia to that of the link.
///
/// At q (nv), unless empty, the object touches nothing: a pair whose ellipsoids overlap there may stay as close as it is
/// (LinkPair::contact), less `attached_distance` [m]. Throws std::invalid_argument that names the object and what is wrong: a
/// name that is taken, a link that is unknown or that no joint moves, no ellipsoid or an invalid one, an invalid inertia.
Arm attach(const Arm& arm, const Attachment& object, const Eigen::VectorXd& q = {});

/// Doubt about the place of a held object, in words that name the distance; empty: none.
///
/// Its cover is farther from the links that move with its link than 2.5 times their size, that is 0.3 to 0.4 m. Or it is farther
/// than 0.15 m, but near them at q (nv), unless empty, if its pose is read in the world's frame.
std::string doubt(const Arm& holding, const Attachment& object, const Eigen::VectorXd& q = {});

// Slack of an attached object towards what it overlaps or rests on when it is attached [m].
constexpr double attached_distance = 0.001;

/// An object that stands on something, and how much its cover was cut there.
struct RestingObject {
  Attachment object;
  /// Largest distance of the whole ellipsoid from what is left of it [m], one per ellipsoid of the cover.
  std::vector<double> given;
};

/// The object with its ellipsoids reduced to smaller ones inside them, which keep `distance` [m] from the points of the
/// obstacles that it rests on.
///
/// For the ellipsoid {c + A u : |u| <= 1} and a plane at w·u = β, w a unit vector, the smaller one is
/// {c − (1 − β)/2 A w + A (√a I + (a − √a) w wᵀ) u}, a = (1 + β)/2: it touches the plane and, on the other side, the ellipsoid.
/// Throws std::invalid_argument that names the object and an obstacle: an unknown one, one in which the object is more than
/// `deepest_rest` [m] deep, or one that has a whole ellipsoid within the distance.
RestingObject resting(const Robot& robot, const Attachment& object, const Eigen::VectorXd& q, const Obstacles& obstacles,
                      double distance);

constexpr double deepest_rest = 0.03;  // Largest depth in an obstacle that counts as standing on it [m].

}  // namespace sidestep
