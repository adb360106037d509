#include "sidestep/body/body_ellipsoid.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {

std::vector<BodyEllipsoid> body_ellipsoids(const Robot& robot, const Body& body, const char* owner) {
  if (body.levels.size() == 0) {
    throw std::invalid_argument(std::string(owner) + ": the body is not calibrated (it has no levels); use Body.cover");
  }
  std::vector<BodyEllipsoid> ellipsoids;
  for (int k = 0; k < body.num_components(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Frame& frame = robot.frames()[static_cast<std::size_t>(robot.frame_index(body.links[i]))];
    const Eigen::Matrix3d R = frame.X_JF.linear();
    const Eigen::Matrix3d shape = body.levels[k] * R * body.covariances[i] * R.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(shape, Eigen::EigenvaluesOnly);
    ellipsoids.push_back({frame.joint, k, frame.X_JF * body.means.col(k), shape, std::sqrt(eigen.eigenvalues().maxCoeff())});
  }
  std::stable_sort(ellipsoids.begin(), ellipsoids.end(),
                   [](const BodyEllipsoid& a, const BodyEllipsoid& b) { return a.joint < b.joint; });
  return ellipsoids;
}

const KinematicState::Link& link_or_world(const KinematicState& state, int joint) noexcept {
  static const KinematicState::Link world{-1, -1, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), {}, {}, {}};
  return joint < 0 ? world : state.link(joint);
}

PointMotion point_motion(const KinematicState::Link& link, const Eigen::Vector3d& p) noexcept {
  const Eigen::Vector3d velocity = link.velocity.linear + link.velocity.angular.cross(p);
  return {velocity, link.bias.linear + link.bias.angular.cross(p) + link.velocity.angular.cross(velocity)};
}

}  // namespace sidestep
