#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/robot/robot.hpp"
#include "support/random.hpp"

namespace sidestep::test {

/// Limits of the size of a common 7-joint arm.
inline JointLimits arm_limits(int nv) {
  JointLimits limits = JointLimits::unlimited(nv);
  limits.lower.setConstant(-2.5);
  limits.upper.setConstant(2.5);
  limits.velocity.setConstant(2.5);
  limits.acceleration.setConstant(10.0);
  for (int i = 0; i < nv; ++i) {
    limits.effort[i] = 2 * i < nv ? 87.0 : 12.0;
  }
  return limits;
}

/// A chain of revolute joints with alternating axes, 0.3 m apart.
inline Robot serial_arm(JointLimits limits) {
  const int nv = static_cast<int>(limits.lower.size());
  std::vector<Joint> joints;
  std::vector<std::string> names;
  for (int i = 0; i < nv; ++i) {
    Joint joint;
    joint.name = "joint" + std::to_string(i + 1);
    joint.parent = i - 1;
    joint.X_PJ.translation().z() = 0.3;
    joint.axis = i % 2 == 0 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
    joint.coordinate = i;
    names.push_back(joint.name);
    joints.push_back(std::move(joint));
  }
  return Robot("serial_arm", std::move(joints), {Frame{"tip", nv - 1, Eigen::Isometry3d::Identity()}}, std::move(names),
               std::move(limits));
}

/// A random mass matrix with the spread of an arm's: about 1 kg m^2 at the base, 0.05 at the tip.
inline Eigen::MatrixXd random_mass(Random& random, int nv) {
  Eigen::VectorXd scale(nv);
  for (int i = 0; i < nv; ++i) {
    scale[i] = std::pow(0.05, 0.5 * i / std::max(nv - 1, 1));
  }
  const Eigen::MatrixXd core = random.positive_definite(nv, 0.5) / nv;
  const Eigen::MatrixXd M = scale.asDiagonal() * core * scale.asDiagonal();
  return 0.5 * (M + M.transpose());
}

}  // namespace sidestep::test
