#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/perception/depth_image.hpp"

namespace sidestep {

/// Where an image shows things: within its borders and its range, and not behind the arm, of which it is known in blocks of pixels.
class ImageSight {
 public:
  /// front: depth from which on the arm hides what is behind [m], per pixel. The camera must outlive it.
  ImageSight(const DepthCamera& camera, const Eigen::Isometry3d& X_WC, const DepthImage& image, const float* front);

  /// Whether it would show something at a place in the world [m].
  bool shows(const Eigen::Vector3d& place) const noexcept;

 private:
  const DepthCamera* camera_;
  Eigen::Isometry3d X_CW_;
  int columns_;
  std::vector<float> farthest_;  // depth up to which a block shows things [m]
};

}  // namespace sidestep
