#include "sidestep/perception/depth_camera.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sidestep/math/rotation.hpp"

namespace sidestep {
namespace {

constexpr int most_pixels_of_side = 16384;  // Width or height, at most.
constexpr int undistort_rounds = 30;        // Rounds of the fixed-point iteration that inverts a distortion.
constexpr double undistorted = 1e-12;       // What is left when it ends [-].
constexpr double not_undistorted = 1e-3;    // What is left where it has found nothing [-].
constexpr double same_pixel = 0.5;          // Distance of a pixel and the one that its ray leads to [pixel].
constexpr int steps_of_growth = 16;         // at which the slope of a distortion is looked at

[[noreturn]] void refuse_camera(const DepthCamera& camera, const std::string& what) {
  throw std::invalid_argument("camera '" + camera.name + "': " + what);
}

/// The point (x, y) as the polynomial of Brown and Conrady moves it.
Eigen::Vector2d brown_conrady(const std::array<double, 5>& k, double x, double y) noexcept {
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

/// Angle in the image of an angle θ to the optical axis (Kannala and Brandt 2006).
double fisheye_angle(const std::array<double, 5>& k, double theta) noexcept {
  const double t2 = theta * theta;
  return theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

/// Whether r (1 + k1 r² + …) grows from 0 to a radius or an angle r. From where it turns back, it folds onto what is seen.
template <std::size_t num>
bool grows(const std::array<double, num>& k, double r) noexcept {
  for (int step = 1; step <= steps_of_growth; ++step) {
    const double x = r * step / steps_of_growth;
    double slope = 0.0;
    for (std::size_t n = num; n > 0; --n) {
      slope = x * x * (slope + static_cast<double>(2 * n + 1) * k[n - 1]);
    }
    if (!(1.0 + slope > 0.0)) {
      return false;
    }
  }
  return true;
}

/// The point that `move` moves to a given one, near it.
template <class Move>
Eigen::Vector2d undo(const Eigen::Vector2d& moved, Move&& move) noexcept {
  Eigen::Vector2d point = moved;
  for (int round = 0; round < undistort_rounds; ++round) {
    const Eigen::Vector2d off = moved - move(point.x(), point.y());
    point += off;
    if (off.squaredNorm() < undistorted * undistorted) {
      break;
    }
  }
  return point;
}

Eigen::Vector2d undo_fisheye(const std::array<double, 5>& k, const Eigen::Vector2d& moved) noexcept {
  const double angle = moved.norm();
  if (angle < 1e-9) {
    return moved;
  }
  double theta = angle;
  for (int round = 0; round < undistort_rounds; ++round) {
    theta += angle - fisheye_angle(k, theta);
  }
  return moved * (std::tan(std::clamp(theta, 0.0, 1.5)) / angle);
}

void check_numbers(const DepthCamera& c) {
  const auto check = [&](const char* name, double value, double low, double high, const char* allowed) {
    if (!(value >= low && value <= high)) {
      refuse_camera(c, std::string(name) + " is " + std::to_string(value) + ", allowed: " + allowed);
    }
  };
  constexpr double least_focal = 1.0, most_focal = 1e6;
  check("fx", c.fx, least_focal, most_focal, "the focal length in pixels, 1 to 1e6");
  check("fy", c.fy, least_focal, most_focal, "the focal length in pixels, 1 to 1e6");
  check("cx", c.cx, -c.width, 2.0 * c.width, "the principal point in pixels, near the image");
  check("cy", c.cy, -c.height, 2.0 * c.height, "the principal point in pixels, near the image");
  check("noise.constant", c.noise.constant, 0.0, 1.0, "0 to 1 m");
  check("noise.quadratic", c.noise.quadratic, 0.0, 1.0, "0 to 1 per metre");
  check("near", c.near, 1e-3, 1e3, "0.001 to 1000 m");
  check("far", c.far, c.near, 1e3, "near to 1000 m");
  check("translation_error", c.translation_error, 0.0, 0.5, "0 to 0.5 m");
  check("rotation_error", c.rotation_error, 0.0, 0.5, "0 to 0.5 rad");
  check("clock_error", c.clock_error, 0.0, 1.0, "0 to 1 s");
  for (const double k : c.distortion) {
    check("a distortion coefficient", k, -100.0, 100.0, "-100 to 100");
  }
}

void check_corners(const DepthCamera& camera) {
  for (const int u : {0, camera.width - 1}) {
    for (const int v : {0, camera.height - 1}) {
      const Eigen::Vector2d ray = camera.ray(u, v), back = camera.project({ray.x(), ray.y(), 1.0});
      if (!((back - Eigen::Vector2d(u, v)).norm() < same_pixel)) {
        refuse_camera(camera, "pixel (" + std::to_string(u) + ", " + std::to_string(v) +
                                  ") has no ray: the distortion turns back within the image; allowed: coefficients that hold "
                                  "in its corners");
      }
    }
  }
}

}  // namespace

void DepthCamera::validate() const {
  if (name.empty()) {
    throw std::invalid_argument("camera: its name is '', allowed: a name, such as 'front'");
  }
  if (width < 1 || height < 1 || width > most_pixels_of_side || height > most_pixels_of_side) {
    refuse_camera(
        *this, "the image is " + std::to_string(width) + " × " + std::to_string(height) + " pixels, allowed: 1 to 16384 each");
  }
  check_numbers(*this);
  if (!pose.matrix().allFinite()) {
    refuse_camera(*this, "pose has numbers that are not finite");
  }
  check_rotation(pose.linear(), "camera '" + name + "'");
  if (distortion_model == DistortionModel::brown_conrady) {
    check_corners(*this);
  }
}

Eigen::Vector2d DepthCamera::project(const Eigen::Vector3d& p) const noexcept {
  const Eigen::Vector2d ray = p.head<2>() / p.z();
  const std::array<double, 5>& k = distortion;
  Eigen::Vector2d point = ray;
  bool is_seen = true;
  switch (distortion_model) {
    case DistortionModel::none: break;
    case DistortionModel::brown_conrady:
      point = brown_conrady(k, ray.x(), ray.y());
      is_seen = grows(std::array{k[0], k[1], k[4]}, ray.norm());
      break;
    case DistortionModel::inverse_brown_conrady:
      point = undo(ray, [&k](double x, double y) { return brown_conrady(k, x, y); });
      is_seen = (brown_conrady(k, point.x(), point.y()) - ray).norm() < not_undistorted;
      break;
    case DistortionModel::kannala_brandt:
      if (const double r = ray.norm(), angle = std::atan(r); r > 1e-9) {
        point *= fisheye_angle(k, angle) / r;
        is_seen = grows(std::array{k[0], k[1], k[2], k[3]}, angle);
      }
      break;
  }
  if (!is_seen) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return {fx * point.x() + cx, fy * point.y() + cy};
}

Eigen::Vector2d DepthCamera::ray(double u, double v) const noexcept {
  const Eigen::Vector2d point((u - cx) / fx, (v - cy) / fy);
  switch (distortion_model) {
    case DistortionModel::none: return point;
    case DistortionModel::brown_conrady:
      return undo(point, [this](double x, double y) { return brown_conrady(distortion, x, y); });
    case DistortionModel::inverse_brown_conrady: return brown_conrady(distortion, point.x(), point.y());
    case DistortionModel::kannala_brandt: return undo_fisheye(distortion, point);
  }
  return point;
}

CameraRays::CameraRays(const DepthCamera& camera)
    : width_(camera.width),
      height_(camera.height),
      x_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      y_(x_.size()),
      column_low_(static_cast<std::size_t>(camera.width), std::numeric_limits<float>::infinity()),
      column_high_(column_low_.size(), -std::numeric_limits<float>::infinity()),
      row_low_(static_cast<std::size_t>(camera.height), std::numeric_limits<float>::infinity()),
      row_high_(row_low_.size(), -std::numeric_limits<float>::infinity()) {
  for (std::size_t v = 0; v < row_low_.size(); ++v) {
    for (std::size_t u = 0; u < column_low_.size(); ++u) {
      const Eigen::Vector2f ray = camera.ray(static_cast<double>(u), static_cast<double>(v)).cast<float>();
      const std::size_t i = v * column_low_.size() + u;
      x_[i] = ray.x();
      y_[i] = ray.y();
      column_low_[u] = std::min(column_low_[u], ray.x());
      column_high_[u] = std::max(column_high_[u], ray.x());
      row_low_[v] = std::min(row_low_[v], ray.y());
      row_high_[v] = std::max(row_high_[v], ray.y());
    }
  }
}

CameraRays::Window CameraRays::window(double x0, double x1, double y0, double y1) const noexcept {
  const auto bounds = [](const std::vector<float>& low, const std::vector<float>& high, double from, double to, int& first,
                         int& end) {
    const auto hits = [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      return static_cast<double>(high[k]) >= from && static_cast<double>(low[k]) <= to;
    };
    first = 0;
    end = static_cast<int>(low.size());
    while (first < end && !hits(first)) {
      ++first;
    }
    while (end > first && !hits(end - 1)) {
      --end;
    }
  };
  Window window;
  bounds(column_low_, column_high_, x0, x1, window.u0, window.u1);
  bounds(row_low_, row_high_, y0, y1, window.v0, window.v1);
  return window;
}

}  // namespace sidestep
