// Reach around an obstacle, in C++: the twin of examples/03_reach_around_an_obstacle.py, with the same numbers.
//
// The loop below is what a controller runs at 1 kHz: `acceleration` allocates nothing and never throws.
// Exit code 0 if the arm arrives.

#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/thesis/collision_density.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"

using namespace sidestep;

constexpr int num_joints = 3;
constexpr double length = 0.5;    // [m] of each link
constexpr double width = 0.08;    // [m] of its square cross section
constexpr double period = 0.001;  // [s] of control

Robot planar_arm() {
  std::vector<Joint> joints;
  std::vector<Frame> frames;
  std::vector<std::string> names;
  for (int i = 0; i < num_joints; ++i) {
    Joint joint;
    joint.name = "joint" + std::to_string(i + 1);
    joint.parent = i - 1;
    joint.X_PJ.translation().x() = i == 0 ? 0.0 : length;
    joint.coordinate = i;
    names.push_back(joint.name);
    joints.push_back(joint);
    frames.push_back({"link" + std::to_string(i + 1), i, Eigen::Isometry3d::Identity()});
  }
  JointLimits limits = JointLimits::unlimited(num_joints);
  limits.lower.setConstant(-std::numbers::pi);
  limits.upper.setConstant(std::numbers::pi);
  return {"planar3", joints, frames, names, limits};
}

int main() {
  const Robot robot = planar_arm();
  // One Gaussian per link, with the second moments of its box.
  const Eigen::Vector3d variances = Eigen::Vector3d(length * length, width * width, width * width) / 12.0;
  const Body body({"link1", "link2", "link3"}, Eigen::Vector3d::Ones(),
                  Eigen::Vector3d(length / 2.0, 0.0, 0.0).replicate(1, num_joints),
                  std::vector<Eigen::Matrix3d>(num_joints, variances.asDiagonal()));
  const Obstacles ball(Eigen::Vector3d(0.91, 0.76, 0.0), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d::Zero());

  GeometricSystemSettings settings;
  settings.stiffness = 2.0 * Eigen::Matrix3d::Identity();
  settings.damping = 3.0 * Eigen::Matrix3d::Identity();
  const GeometricSystem system(robot, {std::make_shared<CollisionDensity>(robot, body)}, settings);
  GeometricSystem::Workspace workspace(system);

  Eigen::Vector3d q(1.5, -0.6, 0.3), v(0.0, 0.0, 0.0);
  const Eigen::Vector3d goal(-0.9, 1.2, 1.4);
  for (int k = 0; k < 12000; ++k) {
    if (is_fallback(system.acceleration(q, v, goal, ball, workspace))) {
      return 1;
    }
    q += period * v + 0.5 * period * period * workspace.acceleration;
    v += period * workspace.acceleration;
    if ((k + 1) % 2000 == 0) {
      std::printf("t = %4.1f s   q = %8.5f %8.5f %8.5f\n", (k + 1) * period, q[0], q[1], q[2]);
    }
  }
  const double error = (q - goal).cwiseAbs().maxCoeff();
  std::printf("joint error %.6f rad\n", error);
  return error < 0.01 ? 0 : 1;
}
