#include "sidestep/perception/arm_mask.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "../math/kernels/in_use.hpp"
#include "grown_shape.hpp"
#include "kernels/image_kernel.hpp"

namespace sidestep {
namespace {

constexpr float noise_of_depth = 3.0f;  // Noise along the ray that a pixel of the arm may have, in standard deviations.
constexpr double pixels_at_edge = 1.0;  // Error of a silhouette [pixel].
constexpr double pixels_bled = 2.0;     // Pixels beside a silhouette that may have the arm's depth: a camera matches windows.
constexpr double core_share = 0.5;      // Semi-axes of an ellipsoid's core, as a share of its own: links fill it.
constexpr int core_stride = 2;          // Every how many pixels rays through cores are looked at, in both directions.
constexpr float no_front = std::numeric_limits<float>::infinity();

/// The displacement of the farthest point of an ellipsoid in the camera's frame between two times [m], at most.
double displacement(const BodyEllipsoid& ellipsoid, const ArmInView& from, const ArmInView& to) noexcept {
  const KinematicState::Link &a = link_or_world(from.arm, ellipsoid.joint), &b = link_or_world(to.arm, ellipsoid.joint);
  const Eigen::Matrix3d Ra = from.X_WC.linear().transpose() * a.R_WL, Rb = to.X_WC.linear().transpose() * b.R_WL;
  const Eigen::Vector3d pa = from.X_WC.linear().transpose() * (a.p_WL - from.X_WC.translation());
  const Eigen::Vector3d pb = to.X_WC.linear().transpose() * (b.p_WL - to.X_WC.translation());
  return ((Rb - Ra) * ellipsoid.mean + pb - pa).norm() + ellipsoid.extent * (Rb - Ra).norm() / std::sqrt(2.0);
}

}  // namespace

double ArmResidual::through_share() const noexcept {
  const int open = on_arm + through;
  return open > 0 ? static_cast<double>(through) / open : 0.0;
}

ArmMask::ArmMask(const Robot& robot, const Body& body)
    : ellipsoids_(body_ellipsoids(robot, body, "perception")), growth_(ellipsoids_.size()) {
  cores_.reserve(ellipsoids_.size());
}

ArmMask::Seen ArmMask::see(const Eigen::Vector3d& centre, const Eigen::Matrix3d& shape, const CameraRays& rays) noexcept {
  const Eigen::Matrix3d A = shape.inverse();
  const Eigen::Vector3d b = A * centre;
  const double gamma = centre.dot(b) - 1.0;
  Seen seen{};
  const double a[6] = {A(0, 0), A(1, 1), 2.0 * A(0, 1), 2.0 * A(0, 2), 2.0 * A(1, 2), A(2, 2)};
  std::transform(a, a + 6, seen.a, [](double number) { return static_cast<float>(number); });
  std::transform(b.data(), b.data() + 3, seen.b, [](double number) { return static_cast<float>(number); });
  seen.gamma = static_cast<float>(gamma);
  seen.holds_camera = gamma <= 0.0;

  // Bounds of x and y: planes through the camera that touch the ellipsoid, n = (1, 0, -x) and (0, 1, -y), nᵀ (S - c cᵀ) n = 0.
  const Eigen::Matrix3d C = shape - centre * centre.transpose();
  constexpr double all = std::numeric_limits<double>::infinity();
  double low[2] = {-all, -all}, high[2] = {all, all};
  if (C(2, 2) < 0.0 && centre.z() > 0.0) {
    for (int axis = 0; axis < 2; ++axis) {
      const double root = std::sqrt(std::max(0.0, C(axis, 2) * C(axis, 2) - C(axis, axis) * C(2, 2)));
      low[axis] = (C(axis, 2) + root) / C(2, 2);
      high[axis] = (C(axis, 2) - root) / C(2, 2);
    }
  } else if (centre.z() + std::sqrt(shape(2, 2)) <= 0.0) {
    return seen;  // behind the camera: an empty window
  }
  seen.window = rays.window(low[0], high[0], low[1], high[1]);
  return seen;
}

double ArmMask::growth_of(const BodyEllipsoid& ellipsoid, const DepthCamera& camera, const ArmInView& before,
                          const ArmInView& now, const ArmInView& after) noexcept {
  const KinematicState::Link& link = link_or_world(now.arm, ellipsoid.joint);
  const double distance = (link.R_WL * ellipsoid.mean + link.p_WL - now.X_WC.translation()).norm();
  const double moved = std::max(displacement(ellipsoid, before, now), displacement(ellipsoid, now, after));
  const double pixel = distance / std::min(camera.fx, camera.fy);
  const double elsewhere = camera.translation_error + camera.rotation_error * distance;
  return std::max(elsewhere, pixels_bled * pixel) + pixels_at_edge * pixel + moved;
}

void ArmMask::mark(const DepthCamera& camera, const CameraRays& rays, const ArmInView& before, const ArmInView& now,
                   const ArmInView& after, DepthImage& image) noexcept {
  front_.assign(image.size(), no_front);
  arm_.assign(image.size(), 0.0f);
  cores_.clear();
  const Eigen::Isometry3d X_CW = now.X_WC.inverse();
  for (std::size_t k = 0; k < ellipsoids_.size(); ++k) {
    const BodyEllipsoid& ellipsoid = ellipsoids_[k];
    const KinematicState::Link& link = link_or_world(now.arm, ellipsoid.joint);
    const Eigen::Vector3d centre = X_CW * (link.R_WL * ellipsoid.mean + link.p_WL);
    const Eigen::Matrix3d R = X_CW.linear() * link.R_WL;
    const Eigen::Matrix3d shape = R * ellipsoid.shape * R.transpose();
    const double growth = growth_[k] = growth_of(ellipsoid, camera, before, now, after);
    mark(see(centre, grown_shape(shape, growth), rays), camera, rays, image);
    cores_.push_back(see(centre, core_share * core_share * shape, rays));
  }
  PixelLabel* const labels = image.labels();
  for (std::size_t i = 0; i < image.size(); ++i) {
    if (arm_[i] > 0.0f) {
      labels[i] = PixelLabel::arm;
    }
  }
  residual_ = {};
  depth_errors_ = 0.0;
  for (const Seen& core : cores_) {
    if (!core.holds_camera) {
      measure(core, camera, rays, image);
    }
  }
  residual_.depth_error = residual_.on_arm > 0 ? depth_errors_ / residual_.on_arm : 0.0;
  image.mark_edges_of_arm(camera);
}

void ArmMask::mark(const Seen& seen, const DepthCamera& camera, const CameraRays& rays, DepthImage& image) noexcept {
  const kernels::ImageKernel kernel = SIDESTEP_KERNEL_IN_USE(kernels::image_kernel)();
  kernels::RayEllipsoid ellipsoid;
  std::copy(seen.a, seen.a + 6, ellipsoid.a);
  std::copy(seen.b, seen.b + 3, ellipsoid.b);
  ellipsoid.gamma = seen.gamma;
  ellipsoid.constant = noise_of_depth * static_cast<float>(camera.noise.constant);
  ellipsoid.quadratic = noise_of_depth * static_cast<float>(camera.noise.quadratic);
  ellipsoid.hides = !seen.holds_camera;
  for (int v = seen.window.v0; v < seen.window.v1; ++v) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(v) * image.width() + seen.window.u0;
    kernel.mark(ellipsoid, rays.x() + first, rays.y() + first, image.depth() + first, seen.window.u1 - seen.window.u0,
                front_.data() + first, arm_.data() + first);
  }
}

void ArmMask::measure(const Seen& core, const DepthCamera& camera, const CameraRays& rays, const DepthImage& image) noexcept {
  const int u0 = (core.window.u0 + core_stride - 1) / core_stride * core_stride;
  const int v0 = (core.window.v0 + core_stride - 1) / core_stride * core_stride;
  for (int v = v0; v < core.window.v1; v += core_stride) {
    for (int u = u0; u < core.window.u1; u += core_stride) {
      const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(u);
      const float x = rays.x()[i], y = rays.y()[i], z = image.depth()[i];
      const float a = x * (core.a[0] * x + core.a[2] * y + core.a[3]) + y * (core.a[1] * y + core.a[4]) + core.a[5];
      const float b = core.b[0] * x + core.b[1] * y + core.b[2];
      if (b * b < a * core.gamma || b <= 0.0f || !has_surface(image.labels()[i])) {
        continue;
      }
      ++residual_.rays;
      if (image.labels()[i] == PixelLabel::arm) {
        ++residual_.on_arm;
        depth_errors_ += static_cast<double>(z - front_[i]);
      } else if (static_cast<double>(z) >
                 static_cast<double>(front_[i]) + noise_of_depth * camera.noise.sigma(static_cast<double>(z))) {
        ++residual_.through;
      }
    }
  }
}

}  // namespace sidestep
