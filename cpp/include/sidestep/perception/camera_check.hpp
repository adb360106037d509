#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "sidestep/arm/arm.hpp"
#include "sidestep/math/vectors.hpp"
#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/perception/depth_image.hpp"

namespace sidestep {

/// Where a camera is and how its clock goes, as the arm in its images says.
struct CameraCorrection {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< X_WC, or X_LC on a link, that fits best
  double translation = 0.0, rotation = 0.0;                ///< by which it differs from what was told [m], [rad]
  double clock_offset =
      0.0;  ///< to add to the times of images [s]: positive where their stamps are early; NaN: not known, the arm does not move enough
  double rms_before = 0.0, rms_after = 0.0;  ///< distance of points from the surface of the arm [m], robust
  double overshoot = 0.0;  ///< by which the cover is larger than the arm, where it was seen, on average [m]: taken off
  /// Half the difference of what each second image alone says: how well this repeats.
  double translation_spread = 0.0, rotation_spread = 0.0, clock_spread = 0.0;
  int images = 0, points = 0;
  std::string question;  ///< what is hard to believe, in words; empty: nothing
};

/// Measures pose and clock offset of a camera from the arm that moves in view.
///
/// Minimises the robust sum of the distances |d(X_WC p, q(t + τ)) + o| of points p of the images from the surface of the arm over the pose
/// X_WC and the clock offset τ, by Gauss-Newton steps; d is the first-order distance to the covering ellipsoids, o the mean overshoot of the
/// link's cover. Points of other things near the arm are outliers. What the images do not say stays as it was told.
class CameraCheck {
 public:
  /// Throws std::invalid_argument that names the camera, the value and what is allowed.
  CameraCheck(const Arm& arm, const DepthCamera& camera);

  /// The arm was at q (nv) at a time [s], later than the last one. Throws std::invalid_argument otherwise.
  void add_state(double time, const Eigen::VectorXd& q);
  /// An image, captured at a time [s] for which there are states before and after, when `solve` is called.
  void add(const RawDepth& depth, double time);

  /// Throws std::runtime_error where there is too little to go by: fewer than three images with the arm in view.
  CameraCorrection solve() const;
  const DepthCamera& camera() const noexcept { return camera_; }

 private:
  struct Image {
    double time;
    Eigen::Matrix3Xd points;  // optical frame [m]
  };
  struct Fit;

  /// The same with the points near the arm alone, wherever the camera may be.
  CameraCheck near_arm() const;
  bool state_at(double time, Eigen::VectorXd& q) const;

  Arm arm_;
  DepthCamera camera_;
  CameraRays rays_;
  DepthImage image_;
  std::vector<double> times_;
  std::vector<Eigen::VectorXd> states_;
  std::vector<Image> images_;
};

}  // namespace sidestep
