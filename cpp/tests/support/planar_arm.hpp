#pragma once

#include "sidestep/scene/obstacles.hpp"
#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep::test {

/// Two joints that turn links of 0.3 m in the plane.
inline Robot planar_arm() {
  Joint joint;
  joint.name = "joint";
  JointLimits limits = JointLimits::unlimited(2);
  limits.lower.setConstant(-3.0);
  limits.upper.setConstant(3.0);
  Joint second = joint;
  second.name = "second";
  second.parent = 0;
  second.coordinate = 1;
  second.X_PJ.translation().x() = 0.3;
  return Robot("turning", {joint, second},
               {Frame{"link", 0, Eigen::Isometry3d::Identity()}, Frame{"tip", 1, Eigen::Isometry3d::Identity()}},
               {"joint", "second"}, std::move(limits));
}

/// A slim ellipsoid around each of its links.
inline ClearanceQuery planar_arm_body() {
  Eigen::Matrix3Xd means = Eigen::Matrix3Xd::Zero(3, 2);
  means.row(0).setConstant(0.15);
  const Eigen::Matrix3d shape = Eigen::Vector3d(0.16 * 0.16, 0.02 * 0.02, 0.02 * 0.02).asDiagonal();
  return ClearanceQuery(planar_arm(),
                        Body({"link", "tip"}, Eigen::VectorXd::Ones(2), means, {shape, shape}, Eigen::VectorXd::Ones(2)));
}

}  // namespace sidestep::test
