#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/perception/depth_image.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// An arm and a camera at one time.
struct ArmInView {
  const KinematicState& arm;
  Eigen::Isometry3d X_WC;
};

/// How far what a camera sees is from where the arm should be.
///
/// Of rays that pass through the cores of covering ellipsoids, which the links fill.
struct ArmResidual {
  int rays = 0;     ///< rays through a core, with a depth
  int on_arm = 0;   ///< that end on the arm
  int through = 0;  ///< that end behind the arm: it is not where it should be
  double depth_error =
      0.0;  ///< Mean of the measured depth less that of the cover, of those on the arm [m]: the overshoot of the cover, and errors.

  /// Share of rays that see through the arm, of those that nothing hides; 0 where there are none.
  double through_share() const noexcept;
};

/// The arm in the image: which pixels show its links and what it holds, and from which depth on it hides what is behind.
///
/// Each covering ellipsoid {p : (p - c)ᵀ S⁻¹ (p - c) <= 1} grows by δ, what errors explain at its place:
///     δ = max(translation error + rotation error · distance, two pixels) + one pixel
///         + the way that it moves in the camera's frame within the clock error,
/// where two pixels are what a silhouette bleeds, to S' = (1 + δ/a) S + (1 + a/δ) δ² I with the mean semi-axis a, which contains all
/// points within δ of it. A ray z (x, y, 1) is inside where α z² - 2 β z + γ <= 0; a pixel shows the arm where its depth is there, but for
/// three standard deviations of noise along the ray.
class ArmMask {
 public:
  /// Throws std::invalid_argument where the body is not calibrated.
  ArmMask(const Robot& robot, const Body& body);

  /// Marks the pixels of `image` that show the arm, and those that fly at its silhouette. `before` and `after`: earlier and later than `now`
  /// by as much as the clock of the image may be wrong. No allocation.
  void mark(const DepthCamera& camera, const CameraRays& rays, const ArmInView& before, const ArmInView& now,
            const ArmInView& after, DepthImage& image) noexcept;

  /// Depth of the nearest surface of the grown arm [m], per pixel of the last image; infinite where it is not.
  const float* front() const noexcept { return front_.data(); }
  const ArmResidual& residual() const noexcept { return residual_; }
  const std::vector<BodyEllipsoid>& ellipsoids() const noexcept { return ellipsoids_; }
  /// Growth δ of each ellipsoid of the last image [m], as in `body_ellipsoids`.
  const std::vector<double>& growth() const noexcept { return growth_; }

 private:
  /// An ellipsoid in the optical frame, as rays meet it: α(x, y) by a, β by b, γ.
  struct Seen {
    float a[6], b[3], gamma;  // α = a0 x² + a1 y² + a2 xy + a3 x + a4 y + a5; β = b0 x + b1 y + b2
    CameraRays::Window window;
    bool holds_camera;
  };
  static Seen see(const Eigen::Vector3d& centre, const Eigen::Matrix3d& shape, const CameraRays& rays) noexcept;
  static double growth_of(const BodyEllipsoid& ellipsoid, const DepthCamera& camera, const ArmInView& before,
                          const ArmInView& now, const ArmInView& after) noexcept;
  void mark(const Seen& seen, const DepthCamera& camera, const CameraRays& rays, DepthImage& image) noexcept;
  void measure(const Seen& core, const DepthCamera& camera, const CameraRays& rays, const DepthImage& image) noexcept;

  std::vector<BodyEllipsoid> ellipsoids_;
  std::vector<double> growth_;
  std::vector<Seen> cores_;
  std::vector<float> front_, arm_;  // arm_: 1 where a pixel shows the arm
  ArmResidual residual_;
  double depth_errors_ = 0.0;
};

}  // namespace sidestep
