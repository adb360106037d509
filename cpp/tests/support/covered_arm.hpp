#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/attractor/goal.hpp"
#include "sidestep/arm/arm.hpp"
#include "sidestep/controller/source.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "support/serial_arm.hpp"

namespace sidestep::test {

/// The serial arm with a slim ellipsoid around each of its links of 0.3 m, inertias, and pairs of all links that are
/// not neighbours.
inline Arm covered_arm(JointLimits limits, bool has_pairs = true, bool has_dynamics = true) {
  const Robot bare = serial_arm(std::move(limits));
  const int nv = bare.num_coordinates();
  std::vector<Frame> frames;
  std::vector<std::string> links;
  std::vector<LinkPair> pairs;
  for (int i = 0; i < nv; ++i) {
    links.push_back("link" + std::to_string(i + 1));
    frames.push_back({links.back(), i, Eigen::Isometry3d::Identity()});
    for (int j = 0; has_pairs && j + 2 <= i; ++j) {
      pairs.push_back({links[static_cast<std::size_t>(j)], links.back(), 0.0});
    }
  }
  Eigen::Isometry3d X_tip = Eigen::Isometry3d::Identity();
  X_tip.translation().z() = 0.3;
  frames.push_back({"tip", nv - 1, X_tip});
  Eigen::Matrix3Xd means = Eigen::Matrix3Xd::Zero(3, nv);
  means.row(2).setConstant(0.15);
  const Eigen::Matrix3d shape = Eigen::Vector3d(0.04 * 0.04, 0.05 * 0.05, 0.17 * 0.17).asDiagonal();
  Body body(links, Eigen::VectorXd::Ones(nv), means, std::vector<Eigen::Matrix3d>(links.size(), shape),
            Eigen::VectorXd::Ones(nv));
  const Inertial inertial{0.3, {0.0, 0.0, 0.15}, Eigen::Vector3d(3e-3, 3e-3, 1e-3).asDiagonal()};
  return Arm(Robot("covered_arm", bare.joints(), std::move(frames), bare.coordinate_names(), bare.limits()), std::move(body),
             std::move(pairs), {},
             has_dynamics ? std::vector<Inertial>(static_cast<std::size_t>(nv), inertial) : std::vector<Inertial>{});
}

inline KinematicState state_at(const Robot& robot, const Eigen::VectorXd& q) {
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  return state;
}

/// The pose of the tip at a configuration.
inline PoseGoal pose_of(const Robot& robot, const Eigen::VectorXd& q) {
  return PoseGoal(robot, "tip", frame_pose(robot, state_at(robot, q), robot.frame_index("tip")));
}

/// Of what moves as it was told, and that nobody tells again.
inline const SourceOptions for_ever{.valid_for = std::numeric_limits<double>::infinity()};

inline Obstacles ball(const Eigen::Vector3d& point, double radius, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) {
  return Obstacles(point, Eigen::VectorXd::Constant(1, radius), velocity);
}

}  // namespace sidestep::test
