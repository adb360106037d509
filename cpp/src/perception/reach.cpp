#include "reach.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/math/random_stream.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {
namespace {

constexpr int reach_samples = 2000;  // Random configurations of which the reach is taken.
constexpr double reach_more = 1.05;  // Reach in what these reach.

}  // namespace

Reach reach_of(const Arm& arm) {
  const Robot& robot = arm.robot();
  const std::vector<BodyEllipsoid> ellipsoids = body_ellipsoids(robot, arm.body(), "perception");
  const Eigen::Vector3d centre =
      robot.num_joints() > 0 ? Eigen::Vector3d(robot.joints().front().X_PJ.translation()) : Eigen::Vector3d::Zero();
  KinematicState state(robot);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(robot.num_coordinates());
  Eigen::VectorXd q = zero;
  RandomStream random(0);
  double farthest = 0.0;
  for (int sample = 0; sample < reach_samples; ++sample) {
    for (int i = 0; i < robot.num_coordinates(); ++i) {
      const double low = robot.limits().lower[i], high = robot.limits().upper[i];
      q[i] = std::isfinite(low) && std::isfinite(high) ? random.uniform(low, high)
             : robot.is_prismatic(i)                   ? 0.0
                                                       : random.uniform(-std::numbers::pi, std::numbers::pi);
    }
    state.update(robot, q, zero);
    for (const BodyEllipsoid& ellipsoid : ellipsoids) {
      const KinematicState::Link& link = link_or_world(state, ellipsoid.joint);
      farthest = std::max(farthest, (link.R_WL * ellipsoid.mean + link.p_WL - centre).norm() + ellipsoid.extent);
    }
  }
  return {centre, reach_more * farthest};
}

}  // namespace sidestep
