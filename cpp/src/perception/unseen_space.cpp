#include "sidestep/perception/unseen_space.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "grown_shape.hpp"

namespace sidestep {
namespace {

constexpr double voxels_per_cell = 2.0;  // Edge of a cell in voxels.
constexpr float never = -1e30f;          // Time of a cell that nobody has seen [s].
constexpr double noise_of_sight = 3.0;   // Noise of a depth behind a cell, in standard deviations.

}  // namespace

UnseenSpace::UnseenSpace(const Eigen::Vector3d& centre, double reach, const PerceptionSettings& settings)
    : centre_(centre),
      reach_(reach),
      edge_(voxels_per_cell * settings.voxel),
      memory_(settings.memory),
      side_(static_cast<int>(std::ceil(2.0 * reach / edge_))) {
  corner_ = centre.array() - 0.5 * edge_ * side_;
  seen_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_), never);
}

void UnseenSpace::add(const SeenImage& seen) noexcept {
  if (!has_begun_) {
    has_begun_ = true;
    begin_ = seen.time;
  }
  const Eigen::Isometry3d X_CW = seen.X_WC.inverse();
  const Eigen::Vector3d along = edge_ * X_CW.linear().col(0);
  const double half = 0.5 * std::sqrt(3.0) * edge_;
  const auto now = static_cast<float>(seen.time - begin_);
  for (int k = 0; k < side_; ++k) {
    for (int j = 0; j < side_; ++j) {
      Eigen::Vector3d p = X_CW * middle(0, j, k);
      for (int i = 0; i < side_; ++i, p += along) {
        if (p.z() < seen.camera.near || p.z() > seen.camera.far) {
          continue;
        }
        const Eigen::Vector2d pixel = seen.camera.project(p);
        if (!(pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < seen.camera.width - 1 &&
              pixel.y() < seen.camera.height - 1)) {
          continue;
        }
        const std::size_t n = static_cast<std::size_t>(std::lround(pixel.y())) * static_cast<std::size_t>(seen.camera.width) +
                              static_cast<std::size_t>(std::lround(pixel.x()));
        const PixelLabel label = seen.image.labels()[n];
        if (!has_surface(label)) {
          continue;
        }
        if (seen.sees_to(n) > p.z() + std::max(0.0, half - noise_of_sight * seen.camera.noise.sigma(p.z()))) {
          seen_[index(i, j, k)] = now;
        }
      }
    }
  }
}

void UnseenSpace::forget() noexcept { std::fill(seen_.begin(), seen_.end(), never); }

void UnseenSpace::add_arm(const Eigen::Vector3d& centre, const Eigen::Matrix3d& shape, double time) noexcept {
  const Eigen::Matrix3d grown = grown_shape(shape, edge_ * std::sqrt(3.0));
  const Eigen::Matrix3d inverse = grown.inverse();
  const Eigen::Vector3d half = grown.diagonal().cwiseSqrt();
  Eigen::Vector3i first, last;
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = std::clamp(static_cast<int>(std::floor((centre[axis] - half[axis] - corner_[axis]) / edge_)), 0, side_ - 1);
    last[axis] = std::clamp(static_cast<int>(std::floor((centre[axis] + half[axis] - corner_[axis]) / edge_)), 0, side_ - 1);
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      for (int i = first[0]; i <= last[0]; ++i) {
        const Eigen::Vector3d away = middle(i, j, k) - centre;
        if (away.dot(inverse * away) <= 1.0) {
          seen_[index(i, j, k)] = static_cast<float>(time - begin_);
        }
      }
    }
  }
}

Eigen::Matrix3Xd UnseenSpace::border(double time) const {
  std::vector<Eigen::Vector3d> found;
  for (int k = 1; k + 1 < side_; ++k) {
    for (int j = 1; j + 1 < side_; ++j) {
      for (int i = 1; i + 1 < side_; ++i) {
        const std::size_t n = index(i, j, k);
        if (is_seen(n, time) || !is_within(i, j, k)) {
          continue;
        }
        const std::size_t row = static_cast<std::size_t>(side_), slice = row * row;
        if (is_seen(n - 1, time) || is_seen(n + 1, time) || is_seen(n - row, time) || is_seen(n + row, time) ||
            is_seen(n - slice, time) || is_seen(n + slice, time)) {
          found.push_back(middle(i, j, k));
        }
      }
    }
  }
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(found.size()));
  for (std::size_t n = 0; n < found.size(); ++n) {
    points.col(static_cast<Eigen::Index>(n)) = found[n];
  }
  return points;
}

double UnseenSpace::seen_share(double time) const noexcept {
  double seen = 0.0, all = 0.0;
  for (int k = 0; k < side_; ++k) {
    for (int j = 0; j < side_; ++j) {
      for (int i = 0; i < side_; ++i) {
        if (is_within(i, j, k)) {
          all += 1.0;
          seen += is_seen(index(i, j, k), time) ? 1.0 : 0.0;
        }
      }
    }
  }
  return all > 0.0 ? seen / all : 0.0;
}

}  // namespace sidestep
