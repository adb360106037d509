#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "support/random.hpp"

namespace sidestep::test {

inline Eigen::Isometry3d random_pose(Random& random, double spread) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(Eigen::Vector4d(random.vector(4)).normalized()).toRotationMatrix();
  X.translation() = spread * random.vector(3);
  return X;
}

/// A branching tree of `num` joints of both kinds with arbitrary axes, two of which share a coordinate (a mimic).
inline Robot random_tree(Random& random, int num) {
  std::vector<Joint> joints;
  std::vector<Frame> frames;
  std::vector<std::string> names;
  for (int i = 0; i < num; ++i) {
    Joint joint;
    joint.name = "joint" + std::to_string(i);
    joint.type = random.chance(0.25) ? JointType::prismatic : JointType::revolute;
    joint.parent = i == 0 ? -1 : (random.chance(0.2) ? random.integer(0, i - 1) : i - 1);
    joint.X_PJ = random_pose(random, 0.2);
    joint.axis = random.vector(3).normalized();
    const bool mimic = i + 1 == num && i > 0;
    joint.coordinate = mimic ? 0 : i;
    joint.multiplier = mimic ? -0.6 : 1.0;
    joint.offset = mimic ? 0.3 : 0.0;
    if (!mimic) {
      names.push_back(joint.name);
    }
    joints.push_back(joint);
    frames.push_back({"link" + std::to_string(i), i, random_pose(random, 0.1)});
  }
  JointLimits limits = JointLimits::unlimited(static_cast<int>(names.size()));
  limits.lower.setConstant(-3.0);
  limits.upper.setConstant(3.0);
  limits.acceleration.setConstant(10.0);
  return Robot("tree", std::move(joints), std::move(frames), std::move(names), std::move(limits));
}

/// Two Gaussians on every frame, standard deviations of 5 to 50 cm.
inline Body random_body(Random& random, const Robot& robot) {
  std::vector<std::string> links;
  std::vector<Eigen::Matrix3d> covariances;
  for (const Frame& frame : robot.frames()) {
    for (int k = 0; k < 2; ++k) {
      const Eigen::Matrix3d R = random_pose(random, 0.0).linear();
      const Eigen::Vector3d deviations = Eigen::Vector3d::NullaryExpr([&] { return random.uniform(0.05, 0.5); });
      links.push_back(frame.name);
      covariances.push_back(R * deviations.cwiseAbs2().asDiagonal() * R.transpose());
    }
  }
  const auto num = static_cast<int>(links.size());
  return Body(std::move(links), Eigen::VectorXd::Constant(num, 0.5), 0.1 * random.matrix(3, num), std::move(covariances));
}

/// Moving points, every second one with a radius.
inline Obstacles random_obstacles(Random& random, int num) {
  Eigen::VectorXd radii = Eigen::VectorXd::Zero(num);
  for (int i = 0; i < num; i += 2) {
    radii[i] = random.uniform(0.01, 0.1);
  }
  return Obstacles(0.4 * random.matrix(3, num), std::move(radii), 0.5 * random.matrix(3, num));
}

}  // namespace sidestep::test
