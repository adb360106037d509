#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sidestep/controller/controller.hpp"
#include "sidestep/perception/arm_mask.hpp"
#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/perception/depth_image.hpp"
#include "sidestep/perception/perception_settings.hpp"
#include "sidestep/perception/voxel_map.hpp"

namespace sidestep {

/// When an image was captured, and where the arm and the camera were then.
struct Capture {
  double time = 0.0;                                     ///< [s] on the clock of Controller::step
  Eigen::VectorXd q = {};                                ///< (nv) of the arm; empty: as the controller's history says
  std::optional<Eigen::Isometry3d> pose = std::nullopt;  ///< X_WC of the camera; none: as it is mounted
};

/// What became of an image, and what it cost.
struct PerceptionReport {
  bool used = false;  ///< false: obstacles are as before, and the question says why
  int obstacle_pixels = 0, arm_pixels = 0, edge_pixels = 0;
  int seen = 0;          ///< number of obstacles that this camera shows now
  int remembered = 0;    ///< number of those that no camera shows now
  int explained = 0;     ///< number of cells that told shapes explain, or that are left out
  int unseen = 0;        ///< number of obstacles where nobody has looked
  ArmResidual arm;       ///< of this image
  double through = 0.0;  ///< share of rays that see through the arm, smoothed over half a second
  std::string question;  ///< what is hard to believe, such as that the arm is not where it should be; empty: nothing
  /// Times of the stages [s]: depth and edges, mask of the arm, points and map, unseen space, obstacles for the controller.
  double depth_time = 0.0, mask_time = 0.0, map_time = 0.0, unseen_time = 0.0, obstacles_time = 0.0;

  double total_time() const noexcept { return depth_time + mask_time + map_time + unseen_time + obstacles_time; }
};

/// From depth cameras to the obstacles of a controller: takes the arm out of the image, remembers what is hidden, and hands the rest on.
///
/// Each camera is a source of the controller, of its name. It is expected from construction on: the arm waits for its first image. What no
/// camera shows now is the source `memory`; where nobody has looked, if that counts as occupied, `unseen`. Calls from several threads wait
/// for each other; none of them waits for `step`.
class Perception {
 public:
  static constexpr const char* memory_source = "memory";
  static constexpr const char* unseen_source = "unseen";

  /// The controller must outlive this. Throws std::invalid_argument that names the camera or the setting, its value and what is allowed.
  Perception(Controller& controller, std::vector<DepthCamera> cameras, const PerceptionSettings& settings = {});
  ~Perception();
  Perception(const Perception&) = delete;
  Perception& operator=(const Perception&) = delete;

  /// Takes an image of a camera. Throws std::invalid_argument that names the value and what is allowed.
  PerceptionReport update(const std::string& camera, const RawDepth& depth, const Capture& capture);
  /// The same of points (3 × N) in the camera's optical frame [m].
  PerceptionReport update(const std::string& camera, const Eigen::Matrix3Xd& points, const Capture& capture);

  /// What is within `grow` [m] of these balls is no obstacle: what is to be grasped, or a place where noise is known. In the world, or on
  /// a link (frame) of the arm, at the time of capture. Replaces a region of the same name.
  void leave_out(const std::string& name, const Obstacles& region, double grow, const std::string& link = "");
  /// Throws std::invalid_argument that lists the regions.
  void take_in(const std::string& name);
  /// Forgets all that was seen.
  void forget();

  const std::vector<DepthCamera>& cameras() const noexcept { return cameras_; }
  /// That of a name. Throws std::invalid_argument for a name that no camera has.
  const DepthCamera& camera(const std::string& name) const;
  const PerceptionSettings& settings() const noexcept { return settings_; }
  /// Pose X_WC of a camera at its last image, used or not; where it is mounted before the first.
  Eigen::Isometry3d pose(const std::string& camera) const;
  /// The last image of a camera, checked: depth [m], 0 where nothing was seen.
  std::vector<float> depth(const std::string& camera) const;
  /// What its pixels show, also of an image that was not used.
  std::vector<PixelLabel> labels(const std::string& camera) const;
  /// Time of its last image that was used [s]; NaN before the first.
  double time(const std::string& camera) const;

  /// An obstacle as it was handed to the controller.
  struct Cell {
    Eigen::Vector3d centre;    ///< [m] in the world
    double radius;             ///< [m]
    int camera;                ///< that showed it last
    double age;                ///< since it was shown last, at the last image of any camera [s]
    bool is_remembered;        ///< no camera shows it now
    Eigen::Vector3d velocity;  ///< as its own camera says [m/s]; copies with another's are not listed
    bool is_hidden;            ///< something is in front of it
  };
  std::vector<Cell> cells() const;
  /// Middles (3 × N) of cells where nobody has looked and that border on seen space [m].
  Eigen::Matrix3Xd unseen() const;

 private:
  struct Impl;
  std::vector<DepthCamera> cameras_;
  PerceptionSettings settings_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sidestep
