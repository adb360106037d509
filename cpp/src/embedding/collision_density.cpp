#include "sidestep/embedding/collision_density.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace sidestep {

CollisionDensity::Peak CollisionDensity::Gaussian::widened(double radius) const noexcept {
  const Eigen::Vector3d inverse = (variances.array() + radius * radius).inverse();
  constexpr double two_pi = 2.0 * std::numbers::pi;
  return {axes * inverse.asDiagonal() * axes.transpose(),
          weight * std::sqrt(inverse.prod() / (two_pi * two_pi * two_pi))};
}

CollisionDensity::CollisionDensity(const Robot& robot, const Body& body, bool average)
    : Embedding(robot), average_(average) {
  std::vector<std::vector<Gaussian>> of_joint(static_cast<std::size_t>(robot.num_joints()));
  for (int k = 0; k < body.num_components(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Frame& frame = robot.frames()[static_cast<std::size_t>(robot.frame_index(body.links[i]))];
    if (frame.joint < 0) {
      continue;
    }
    const Eigen::Matrix3d R = frame.X_JF.linear();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(R * body.covariances[i] * R.transpose());
    Gaussian gaussian{frame.X_JF * body.means.col(k), body.weights[k], eigen.eigenvalues(), eigen.eigenvectors(), {}};
    gaussian.peak = gaussian.widened(0.0);
    of_joint[static_cast<std::size_t>(frame.joint)].push_back(gaussian);
  }
  for (int j = 0; j < robot.num_joints(); ++j) {
    auto& gaussians = of_joint[static_cast<std::size_t>(j)];
    if (!gaussians.empty()) {
      links_.push_back({j, std::move(gaussians)});
    }
  }
  if (links_.empty()) {
    throw std::invalid_argument("collision density: no Gaussian of the body lies on a link that a joint of robot '" +
                                robot.name() + "' moves");
  }
}

void CollisionDensity::add_to(EmbeddingView out, const KinematicState& state,
                              const Obstacles& obstacles) const noexcept {
  const Eigen::Index num_points = obstacles.size();
  if (num_points == 0) {
    return;
  }
  const double share = average_ ? 1.0 / static_cast<double>(num_points) : 1.0;
  double value = 0.0;
  double curvature = 0.0;
  for (const Link& part : links_) {
    const KinematicState::Link& link = state.link(part.joint);
    const Eigen::Matrix3d R_LW = link.R_WL.transpose();
    SpatialForce wrench;
    for (Eigen::Index n = 0; n < num_points; ++n) {
      const Eigen::Vector3d x = obstacles.points().col(n);
      const Eigen::Vector3d x_dot = obstacles.velocities().col(n);
      // The point seen from the link: y, ẏ and ÿ for q̈ = 0 and ẍ = 0.
      const Eigen::Vector3d slip = x_dot - link.velocity.linear - link.velocity.angular.cross(x);
      const Eigen::Vector3d slip_dot = -link.bias.linear - link.bias.angular.cross(x) -
                                       link.velocity.angular.cross(x_dot) - link.velocity.angular.cross(slip);
      const Eigen::Vector3d y = R_LW * (x - link.p_WL);
      const Eigen::Vector3d y_dot = R_LW * slip;
      const Eigen::Vector3d y_ddot = R_LW * slip_dot;
      const double radius = obstacles.radii()[n];

      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      for (const Gaussian& gaussian : part.gaussians) {
        const Peak peak = radius > 0.0 ? gaussian.widened(radius) : gaussian.peak;
        const Eigen::Vector3d e = y - gaussian.mean;
        const Eigen::Vector3d t = peak.precision * e;
        const double density = peak.scale * std::exp(-0.5 * e.dot(t));
        const double slope = t.dot(y_dot);
        value += density;
        curvature += density * (slope * slope - y_dot.dot(peak.precision * y_dot) - t.dot(y_ddot));
        gradient -= density * t;
      }
      // δψ = gradient · δy with δy = −R_LW (δv + δω × x): the wrench −(x × f, f) about the world origin.
      const Eigen::Vector3d f = link.R_WL * gradient;
      wrench.angular -= x.cross(f);
      wrench.linear -= f;
    }
    wrench.angular *= share;
    wrench.linear *= share;
    accumulate_generalised_force(state, part.joint, wrench, out.jacobian_transposed.col(0));
  }
  out.values[0] += share * value;
  out.curvatures[0] += share * curvature;
}

void CollisionDensity::lower_distances(Eigen::Ref<Eigen::VectorXd> distances, const KinematicState& state,
                                       const Obstacles& obstacles) const noexcept {
  for (const Link& part : links_) {
    const KinematicState::Link& link = state.link(part.joint);
    double& distance = distances[link.coordinate];
    for (const Gaussian& gaussian : part.gaussians) {
      const Eigen::Vector3d mean_W = link.p_WL + link.R_WL * gaussian.mean;
      for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
        distance = std::min(distance, (obstacles.points().col(n) - mean_W).norm() - obstacles.radii()[n]);
      }
    }
  }
}

}  // namespace sidestep
