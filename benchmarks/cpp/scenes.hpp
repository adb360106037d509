#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"

// What the benchmarks time: an arm, its body and an obstacle, at the settings of the thesis's Table 6.1.
namespace sidestep::benchmarks {

struct Scene {
  Robot robot;
  Body body;            ///< one Gaussian per link, fitted by hand: centred between joints, as long as the link
  Obstacles obstacles;  ///< one point beside the middle of the arm, at rest
};

/// Rotation by roll, pitch and yaw about fixed axes, as in URDF; and a translation [m].
inline Eigen::Isometry3d placement(const Eigen::Vector3d& translation, double roll) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()).toRotationMatrix();
  X.translation() = translation;
  return X;
}

inline Scene make_scene(std::string name, const std::vector<Eigen::Isometry3d>& placements, JointLimits limits,
                        const Eigen::Vector3d& obstacle) {
  std::vector<Joint> joints;
  std::vector<Frame> frames;
  std::vector<std::string> coordinates, links;
  const auto num = static_cast<Eigen::Index>(placements.size());
  Eigen::Matrix3Xd means(3, num);
  std::vector<Eigen::Matrix3d> covariances;
  for (Eigen::Index i = 0; i < num; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const std::string number = std::to_string(i + 1);
    Joint joint;
    joint.name = "joint" + number;
    joint.parent = static_cast<int>(i) - 1;
    joint.X_PJ = placements[k];
    joint.coordinate = static_cast<int>(i);
    joints.push_back(joint);
    frames.push_back({"link" + number, static_cast<int>(i), Eigen::Isometry3d::Identity()});
    coordinates.push_back(joint.name);
    links.push_back("link" + number);
    const Eigen::Vector3d to_next =
        k + 1 < placements.size() ? Eigen::Vector3d(placements[k + 1].translation()) : Eigen::Vector3d(0, 0, 0.1);
    constexpr double thickness = 0.05;  // [m] standard deviation across a link
    means.col(i) = 0.5 * to_next;
    covariances.push_back(thickness * thickness * Eigen::Matrix3d::Identity() + to_next * to_next.transpose() / 12.0);
  }
  Robot robot(std::move(name), std::move(joints), std::move(frames), std::move(coordinates), std::move(limits));
  Body body(std::move(links), Eigen::VectorXd::Ones(num), std::move(means), std::move(covariances));
  return {std::move(robot), std::move(body),
          Obstacles(Eigen::Matrix3Xd(obstacle), Eigen::VectorXd::Zero(1), Eigen::Matrix3Xd::Zero(3, 1))};
}

/// A planar arm: links of 0.5 m that turn about parallel axes.
inline Scene planar(int num_joints) {
  std::vector<Eigen::Isometry3d> placements(static_cast<std::size_t>(num_joints), placement({0.5, 0.0, 0.0}, 0.0));
  placements.front() = Eigen::Isometry3d::Identity();
  JointLimits limits = JointLimits::unlimited(num_joints);
  limits.lower.setConstant(-std::numbers::pi);
  limits.upper.setConstant(std::numbers::pi);
  limits.acceleration.setConstant(10.0);
  return make_scene("planar" + std::to_string(num_joints), placements, std::move(limits), {0.6, 0.3, 0.0});
}

/// The Franka Research 3 without hand: joint placements and position limits of its URDF.
inline Scene fr3() {
  constexpr double quarter = 0.5 * std::numbers::pi;
  const std::vector<Eigen::Isometry3d> placements = {
      placement({0.0, 0.0, 0.333}, 0.0),          placement({0.0, 0.0, 0.0}, -quarter),
      placement({0.0, -0.316, 0.0}, quarter),     placement({0.0825, 0.0, 0.0}, quarter),
      placement({-0.0825, 0.384, 0.0}, -quarter), placement({0.0, 0.0, 0.0}, quarter),
      placement({0.088, 0.0, 0.0}, quarter),
  };
  JointLimits limits = JointLimits::unlimited(7);
  limits.lower << -2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159;
  limits.upper << 2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159;
  limits.acceleration.setConstant(10.0);
  return make_scene("fr3", placements, std::move(limits), {0.4, 0.1, 0.6});
}

/// The same arm covered by 77 ellipsoids, eleven balls stretched along every link.
inline Scene covered_fr3(Obstacles obstacles) {
  constexpr int per_link = 11;
  constexpr double half_width = 0.07;  // [m] of a ball across the link
  Scene scene = fr3();
  std::vector<std::string> links;
  Eigen::Matrix3Xd means(3, per_link * scene.body.num_components());
  std::vector<Eigen::Matrix3d> covariances;
  for (int k = 0; k < scene.body.num_components(); ++k) {
    const Eigen::Vector3d end = 2.0 * scene.body.means.col(k);
    for (int i = 0; i < per_link; ++i) {
      means.col(static_cast<Eigen::Index>(links.size())) = (i + 0.5) / per_link * end;
      links.push_back(scene.body.links[static_cast<std::size_t>(k)]);
      covariances.push_back(half_width * half_width * Eigen::Matrix3d::Identity() +
                            end * end.transpose() / (per_link * per_link));
    }
  }
  const Eigen::Index num = means.cols();
  Body body(std::move(links), Eigen::VectorXd::Constant(num, 1.0 / per_link), std::move(means), std::move(covariances),
            Eigen::VectorXd::Ones(num));
  return {scene.robot, std::move(body), std::move(obstacles)};
}

/// Balls of 6 cm at rest, within the arm's reach.
inline Obstacles balls(int num) {
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Eigen::Matrix3Xd points(3, num);
  for (Eigen::Index n = 0; n < num;) {
    const Eigen::Vector3d p(unit(engine), unit(engine), 0.6 + 0.6 * unit(engine));
    if (p.norm() > 0.5 && p.norm() < 1.2) {
      points.col(n++) = p;
    }
  }
  return Obstacles(std::move(points), Eigen::VectorXd::Constant(num, 0.06), Eigen::Matrix3Xd::Zero(3, num));
}

/// As a camera sees a table top before the arm, 0.8 m by 1.2 m, and the front of a box on it.
inline Obstacles table(int num) {
  std::mt19937_64 engine(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Eigen::Matrix3Xd points(3, num);
  for (Eigen::Index n = 0; n < num; ++n) {
    const double a = unit(engine), b = unit(engine);
    points.col(n) =
        n % 20 == 0 ? Eigen::Vector3d(0.5, 0.2 * b, 0.05 + 0.3 * a) : Eigen::Vector3d(0.25 + 0.8 * a, 1.2 * b - 0.6, 0.05);
  }
  return Obstacles(std::move(points), Eigen::VectorXd::Zero(num), Eigen::Matrix3Xd::Zero(3, num));
}

/// States as a run meets them: configurations in the middle half of the limits, velocities of about 1 rad/s.
struct State {
  Eigen::VectorXd q, v;
};

inline std::vector<State> states(const Robot& robot, int num, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> middle(0.25, 0.75);
  std::normal_distribution<double> normal;
  std::vector<State> result;
  const JointLimits& limits = robot.limits();
  for (int k = 0; k < num; ++k) {
    State state{limits.lower, limits.lower};
    for (Eigen::Index i = 0; i < limits.lower.size(); ++i) {
      state.q[i] += middle(engine) * (limits.upper[i] - limits.lower[i]);
      state.v[i] = normal(engine);
    }
    result.push_back(std::move(state));
  }
  return result;
}

}  // namespace sidestep::benchmarks
