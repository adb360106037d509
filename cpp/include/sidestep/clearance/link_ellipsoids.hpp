#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/clearance/ball_cover.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// A covering ellipsoid in its principal axes, and balls that cover it.
struct LinkEllipsoid : BodyEllipsoid {
  Eigen::Matrix3d axes_T;   ///< Rotation into the principal axes, from the joint's child.
  Eigen::Vector3d squares;  ///< Squared semi-axes, ascending [m²].
  std::vector<CoverBall> cover;
};

/// The ellipsoids of one link, in the frame of its joint's child.
struct LinkEllipsoids {
  std::string name;
  int joint;  ///< Joint that moves it; -1: none.
  std::vector<LinkEllipsoid> ellipsoids;
  std::vector<EllipsoidRow> rows;  ///< The same ellipsoids, side by side.
  Eigen::Vector3d centre;          ///< Centre of a ball around them [m].
  double radius;                   ///< Radius of that ball [m].
};

/// All links of a body that have ellipsoids, those far from the base first: they are the likeliest in the way.
class BodyLinks {
 public:
  /// Throws std::invalid_argument, which `owner` begins, if the body is not calibrated or a link is unknown.
  BodyLinks(const Robot& robot, const Body& body, const char* owner);

  int size() const noexcept { return static_cast<int>(links_.size()); }
  const LinkEllipsoids& operator[](int i) const noexcept { return links_[static_cast<std::size_t>(i)]; }

  /// The number of a link. Throws std::invalid_argument, which `owner` begins, if there is none of the name.
  int index(const Robot& robot, const std::string& name, const char* owner) const;

 private:
  std::vector<LinkEllipsoids> links_;
};

}  // namespace sidestep
