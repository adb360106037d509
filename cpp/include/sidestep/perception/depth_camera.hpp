#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace sidestep {

/// Noise of a depth camera: standard deviation σ(z) = constant + quadratic z² of a depth z [m].
///
/// For stereo quadratic = s/(f b), with the error s of a disparity [pixel], the focal length f [pixel] and the baseline b [m].
struct DepthNoise {
  double constant = 0.001;   ///< [m]
  double quadratic = 0.004;  ///< [1/m]: 0.08 pixel, 420 pixel and 50 mm give 0.0038

  double sigma(double z) const noexcept { return constant + quadratic * z * z; }
};

/// How a lens bends straight lines; with coefficients k1, k2, p1, p2, k3, or k1 to k4 for `kannala_brandt`.
enum class DistortionModel { none, brown_conrady, inverse_brown_conrady, kannala_brandt };

/// A depth camera: its size, intrinsics, place, noise and errors.
///
/// Pixel (u, v), integer at the centre of a pixel, u to the right and v down, sees along the ray (x, y, 1) of the optical frame, with
/// x = (u - cx)/fx and y = (v - cy)/fy where the lens does not distort. A depth is the z of what is seen, not its distance.
struct DepthCamera {
  std::string name;
  int width = 0, height = 0;                      ///< [pixel]
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< focal lengths and principal point [pixel]
  DistortionModel distortion_model = DistortionModel::none;
  std::array<double, 5> distortion{};
  std::string link;                                        ///< Frame of the arm on which it is mounted; empty: the world.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< X_WC, or X_LC on a link; x right, y down, z forward
  DepthNoise noise;
  double near = 0.1, far = 4.0;  ///< range in which depths are believed [m]
  // How wrong pose and times may be.
  double translation_error = 0.005;  ///< [m]
  double rotation_error = 0.005;     ///< [rad]
  double clock_error = 0.005;        ///< of the times of capture [s]

  /// Throws std::invalid_argument that names the value and what is allowed.
  void validate() const;

  /// The pixel (u, v) that sees a point p (optical frame, p.z > 0); it may lie outside of the image. NaN: so far from the axis that the
  /// distortion's polynomial no longer holds. It would fold the point back into the image.
  Eigen::Vector2d project(const Eigen::Vector3d& p) const noexcept;
  /// x and y of the ray (x, y, 1) of a pixel.
  Eigen::Vector2d ray(double u, double v) const noexcept;
};

/// The rays (x, y, 1) of all pixels of a camera, row by row.
class CameraRays {
 public:
  explicit CameraRays(const DepthCamera& camera);

  const float* x() const noexcept { return x_.data(); }
  const float* y() const noexcept { return y_.data(); }

  /// Pixels [u0, u1) × [v0, v1).
  struct Window {
    int u0 = 0, u1 = 0, v0 = 0, v1 = 0;
  };
  /// The pixels whose rays can have x and y between these bounds. No allocation.
  Window window(double x0, double x1, double y0, double y1) const noexcept;

 private:
  int width_, height_;
  std::vector<float> x_, y_;
  std::vector<float> column_low_, column_high_, row_low_, row_high_;  // Bounds of x in a column, and of y in a row.
};

}  // namespace sidestep
