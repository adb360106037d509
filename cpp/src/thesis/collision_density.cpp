#include "sidestep/thesis/collision_density.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "../math/kernels/in_use.hpp"
#include "kernels/density_kernel.hpp"

namespace sidestep {
namespace {

kernels::AddDensity add_density() noexcept { return SIDESTEP_KERNEL_IN_USE(kernels::add_density); }

kernels::DensityPoints points_of(const Obstacles& obstacles, bool average) noexcept {
  return {static_cast<int>(obstacles.size()), average ? 1.0 / static_cast<double>(obstacles.size()) : 1.0,
          obstacles.points().data(), obstacles.radii().data(),
          obstacles.tree().moves() ? obstacles.velocities().data() : nullptr};
}

void set(double (&rows)[3][kernels::most_lanes], int lane, const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) {
    rows[i][lane] = v[i];
  }
}

void set(double (&rows)[6][kernels::most_lanes], int lane, const Eigen::Matrix3d& symmetric) {
  const Eigen::Matrix3d& S = symmetric;
  const double entries[] = {S(0, 0), S(1, 1), S(2, 2), S(0, 1), S(0, 2), S(1, 2)};
  for (int i = 0; i < 6; ++i) {
    rows[i][lane] = entries[i];
  }
}

/// Sets the next lane, in the frame of the joint's child.
void append(kernels::GaussianBlock& block, int joint, double weight, const Eigen::Vector3d& mean,
            const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  const Eigen::Matrix3d& axes = eigen.eigenvectors();
  const Eigen::Vector3d inverse = eigen.eigenvalues().cwiseInverse();
  constexpr double two_pi = 2.0 * std::numbers::pi;
  const int lane = block.num++;
  std::fill(block.joints + lane, block.joints + kernels::most_lanes, joint);  // those without weight have a link too
  set(block.mean, lane, mean);
  set(block.variances, lane, eigen.eigenvalues());
  set(block.precision, lane, axes * inverse.asDiagonal() * axes.transpose());
  for (int i = 0; i < 3; ++i) {
    set(block.projections[i], lane, axes.col(i) * axes.col(i).transpose());
  }
  block.weight[lane] = weight;
  block.scale[lane] = weight * std::sqrt(inverse.prod() / (two_pi * two_pi * two_pi));
}

double sum(const double (&lanes)[kernels::most_lanes]) noexcept {
  return Eigen::Map<const Eigen::Matrix<double, kernels::most_lanes, 1>>(lanes).sum();
}

}  // namespace

struct CollisionDensity::Gaussians {
  std::vector<kernels::GaussianBlock> blocks;
};

CollisionDensity::CollisionDensity(const Robot& robot, const Body& body, bool average) : Embedding(robot), average_(average) {
  const auto frame_of = [&](int k) -> const Frame& {
    return robot.frames()[static_cast<std::size_t>(robot.frame_index(body.links[static_cast<std::size_t>(k)]))];
  };
  std::vector<int> moved;
  for (int k = 0; k < body.num_components(); ++k) {
    if (frame_of(k).joint >= 0) {
      moved.push_back(k);
    }
  }
  if (moved.empty()) {
    throw std::invalid_argument("collision density: no Gaussian of the body lies on a link that a joint of robot '" +
                                robot.name() + "' moves");
  }
  std::stable_sort(moved.begin(), moved.end(), [&](int a, int b) { return frame_of(a).joint > frame_of(b).joint; });
  auto gaussians = std::make_shared<Gaussians>();
  auto& blocks = gaussians->blocks;
  for (const int k : moved) {
    if (blocks.empty() || blocks.back().num == kernels::most_lanes) {
      blocks.emplace_back();
    }
    const Frame& frame = frame_of(k);
    const Eigen::Matrix3d R = frame.X_JF.linear();
    append(blocks.back(), frame.joint, body.weights[k], frame.X_JF * body.means.col(k),
           R * body.covariances[static_cast<std::size_t>(k)] * R.transpose());
  }
  gaussians_ = std::move(gaussians);
}

void CollisionDensity::add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept {
  if (obstacles.size() == 0) {
    return;
  }
  const kernels::DensityPoints points = points_of(obstacles, average_);
  const kernels::AddDensity add = add_density();
  kernels::DensitySums sums;
  std::fill(std::begin(sums.value), std::end(sums.value), 0.0);
  std::fill(std::begin(sums.curvature), std::end(sums.curvature), 0.0);
  GeneralisedForce gradient(state, out.jacobian_transposed.col(0));
  for (const kernels::GaussianBlock& block : gaussians_->blocks) {
    const double* links[kernels::most_lanes];
    for (int i = 0; i < kernels::most_lanes; ++i) {
      links[i] = state.link(block.joints[i]).numbers();
    }
    add(block, links, points, sums);
    for (int i = 0; i < block.num; ++i) {
      Vector6d wrench;
      wrench << sums.moment[0][i], sums.moment[1][i], sums.moment[2][i], sums.force[0][i], sums.force[1][i], sums.force[2][i];
      gradient.add(block.joints[i], wrench);
    }
  }
  gradient.finish();
  out.values[0] += sum(sums.value);
  out.curvatures[0] += sum(sums.curvature);
}

void CollisionDensity::lower_distances(Eigen::Ref<Eigen::VectorXd> distances, const KinematicState& state,
                                       const Obstacles& obstacles) const noexcept {
  for (const kernels::GaussianBlock& block : gaussians_->blocks) {
    for (int i = 0; i < block.num; ++i) {
      const KinematicState::Link& link = state.link(block.joints[i]);
      const Eigen::Vector3d mean(block.mean[0][i], block.mean[1][i], block.mean[2][i]);
      const Eigen::Vector3d mean_W = link.p_WL + link.R_WL * mean;
      double& distance = distances[link.coordinate];
      for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
        distance = std::min(distance, (obstacles.points().col(n) - mean_W).norm() - obstacles.radii()[n]);
      }
    }
  }
}

}  // namespace sidestep
