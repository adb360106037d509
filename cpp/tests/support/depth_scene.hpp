#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep::test {

/// A camera of 160 × 120 pixels at a place, which looks at another one; without noise and errors.
inline DepthCamera small_camera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  DepthCamera camera;
  camera.name = "front";
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 120.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  camera.noise = {0.0, 0.0};
  camera.translation_error = camera.rotation_error = camera.clock_error = 0.0;
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(std::abs(z.z()) > 0.99 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ()).normalized();
  camera.pose.linear().col(0) = x;
  camera.pose.linear().col(1) = z.cross(x);
  camera.pose.linear().col(2) = z;
  camera.pose.translation() = eye;
  return camera;
}

/// Spheres and planes, cast ray by ray: what depth images show, slowly.
struct DepthScene {
  struct Ball {
    Eigen::Vector3d centre;
    Eigen::Matrix3d inverse;  // of the shape matrix
  };
  std::vector<Ball> balls;
  double floor = -std::numeric_limits<double>::infinity();  // height of a floor [m]

  void add_sphere(const Eigen::Vector3d& centre, double radius) {
    balls.push_back({centre, Eigen::Matrix3d::Identity() / (radius * radius)});
  }
  void add_arm(const Robot& robot, const Body& body, const Eigen::VectorXd& q) {
    KinematicState state(robot);
    state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
    for (const BodyEllipsoid& ellipsoid : body_ellipsoids(robot, body, "test")) {
      const KinematicState::Link& link = link_or_world(state, ellipsoid.joint);
      balls.push_back(
          {link.R_WL * ellipsoid.mean + link.p_WL, (link.R_WL * ellipsoid.shape * link.R_WL.transpose()).inverse()});
    }
  }
  /// Depth along the ray of a pixel [m]; 0: nothing.
  double depth(const DepthCamera& camera, const Eigen::Isometry3d& X_WC, int u, int v) const {
    const Eigen::Vector2d ray = camera.ray(u, v);
    const Eigen::Vector3d direction = X_WC.linear() * Eigen::Vector3d(ray.x(), ray.y(), 1.0), from = X_WC.translation();
    double nearest = std::numeric_limits<double>::infinity();
    if (direction.z() < 0.0) {
      nearest = (floor - from.z()) / direction.z();
    }
    for (const Ball& ball : balls) {
      const Eigen::Vector3d o = from - ball.centre;
      const double a = direction.dot(ball.inverse * direction), b = direction.dot(ball.inverse * o),
                   c = o.dot(ball.inverse * o) - 1.0;
      const double square = b * b - a * c;
      const double z = square >= 0.0 ? (-b - std::sqrt(square)) / a : -1.0;
      nearest = z > 0.0 && z < nearest ? z : nearest;
    }
    return std::isfinite(nearest) ? nearest : 0.0;
  }
  std::vector<float> image(const DepthCamera& camera, const Eigen::Isometry3d& X_WC) const {
    std::vector<float> pixels;
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        pixels.push_back(static_cast<float>(depth(camera, X_WC, u, v)));
      }
    }
    return pixels;
  }
  std::vector<float> image(const DepthCamera& camera) const { return image(camera, camera.pose); }
};

}  // namespace sidestep::test
