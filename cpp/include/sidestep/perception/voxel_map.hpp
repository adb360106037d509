#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "sidestep/perception/beside_arm.hpp"
#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/perception/depth_image.hpp"
#include "sidestep/perception/perception_settings.hpp"
#include "sidestep/perception/voxel_grid.hpp"

namespace sidestep {

/// A cell in which something was seen.
struct Voxel {
  float low[3], high[3];              ///< Box of what is in it [m], in the world.
  float frame_low[3], frame_high[3];  ///< The same of the last image that showed it.
  float kept_low[3], kept_high[3];    ///< The box before the arm began to hide a part of it, where `cut_by` any.
  float error;                        ///< By how much what is in it may be elsewhere [m]: calibration of its camera, there.
  double first, last;                 ///< Times of the first and the last image that showed it [s].
  std::uint32_t frame;                ///< Number of that image.
  int cell;                           ///< In the grid; -1: the voxel is not in use.
  int pixels;                         ///< Number of pixels of that image that showed it.
  std::uint8_t camera;                ///< Camera that showed it last.
  std::uint16_t shown_by;             ///< Cameras whose last image shows it, as bits.
  std::uint8_t missed_samples;        ///< Samples since then that saw a surface there, and not in the cell.
  std::uint8_t free_images;           ///< Images in a row that saw through it.
  std::uint8_t gap;                   ///< Images of its camera since the last one that showed it.
  std::uint8_t shown_images;          ///< Images that showed it, at most 255.
  bool counts;                        ///< It is an obstacle; else a second image must show it.
  bool moves;                         ///< What was in it moved when it was seen last.
  std::uint16_t cut_by;               ///< Cameras whose last image of it has the arm beside it, which may hide a part; as bits.
  bool is_hidden;                     ///< The last image that could have shown it did not, since something is in front of it.

  Eigen::Vector3d low_corner() const { return Eigen::Map<const Eigen::Vector3f>(low).cast<double>(); }
  Eigen::Vector3d high_corner() const { return Eigen::Map<const Eigen::Vector3f>(high).cast<double>(); }
  /// Middle of its box.
  Eigen::Vector3d middle() const { return 0.5 * (low_corner() + high_corner()); }
  /// The same of what the last image alone shows.
  Eigen::Vector3d frame_middle() const {
    return 0.5 * (Eigen::Map<const Eigen::Vector3f>(frame_low) + Eigen::Map<const Eigen::Vector3f>(frame_high)).cast<double>();
  }
};

/// An image with all that says what its rays have seen.
struct SeenImage {
  const DepthCamera& camera;
  const CameraRays& rays;
  const Eigen::Isometry3d& X_WC;
  const DepthImage& image;
  const float* depth;      ///< per pixel [m]: of the image, or with less noise
  const float* arm_front;  ///< Depth from which on the arm hides what is behind, per pixel [m].
  std::uint8_t number;     ///< of the camera
  double time;             ///< of capture [s]

  /// Depth up to which a pixel sees [m], of one that shows something: the arm is hidden where it begins.
  double sees_to(std::size_t pixel) const noexcept {
    const float depth = image.labels()[pixel] == PixelLabel::arm ? arm_front[pixel] : this->depth[pixel];
    return std::min(static_cast<double>(depth), camera.far);
  }
};

/// What cameras have seen: cells with points, until they are seen to be free or are forgotten.
///
/// An image adds its points to their cells. Then each cell that it did not show is projected into it: where its depth is behind the
/// whole cell, the cell was seen through, and after `clear_after` such images in a row it is free. Where something is in front of it, the
/// arm is, or nothing was seen, it is hidden, and kept for `memory`; what moved, or was seen for less than 0.1 s or by fewer than three
/// images, for 0.3 s and ten times as long as it was seen: it has left most of its cells. Where the depth is that of the cell, but for
/// noise, the cell is missed by as many of its five samples as show that, and after 25 since it was shown last it was noise.
class VoxelMap {
 public:
  static constexpr double background_after = 1.0;  ///< Time for which a voxel must have been seen to be background [s].

  VoxelMap(const Eigen::Vector3d& centre, double reach, const PerceptionSettings& settings);

  /// Adds an image. May allocate while the number of voxels grows.
  void add(const SeenImage& seen);

  /// All voxels; those with a negative cell are not in use.
  const std::vector<Voxel>& voxels() const noexcept { return voxels_; }
  /// Index of the voxel of a point, -1: none.
  int voxel_of(const float* p) const noexcept {
    const int cell = grid_.cell(p);
    return cell < 0 ? -1 : index_[static_cast<std::size_t>(cell)];
  }
  /// Whether a voxel lies outside of the fine cells and has been seen for longer than `background_after`: it rests where the arm does not get,
  /// so that the controller need not know it.
  bool is_background(const Voxel& voxel) const noexcept {
    return grid_.level(voxel.cell) > 0 && voxel.last - voxel.first > background_after;
  }
  /// Whether what is in a voxel may move: it did when it was seen last, or was seen for too little to be known to rest.
  static bool may_move(const Voxel& voxel) noexcept;
  /// Whether a voxel has rested: it has been seen for long, or noise along the ray explains it by one that has.
  bool is_settled(const Voxel& voxel, const Eigen::Vector3d& eye, const DepthNoise& noise) const noexcept;
  /// Whether a cell next to it has been seen for long.
  bool is_beside_rest(const Voxel& voxel) const noexcept;
  /// Whether an image sees through the box of a voxel.
  bool sees_through(const Voxel& voxel, const SeenImage& seen) const noexcept {
    return sight(voxel, seen, seen.X_WC.inverse()) == Sight::free;
  }
  double edge(const Voxel& voxel) const noexcept { return grid_.edge(grid_.level(voxel.cell)); }
  /// Indices of the voxels that the last image showed.
  const std::vector<int>& touched() const noexcept { return touched_; }
  /// Tells whether what is in a voxel moves: then it is kept for less.
  void set_moves(int index, bool moves) noexcept { voxels_[static_cast<std::size_t>(index)].moves = moves; }
  void clear() noexcept;

 private:
  void add_points(const SeenImage& seen);
  void add_row(const SeenImage& seen, int v);
  Voxel& voxel_at(int cell, double time);
  void begin_frame(Voxel& voxel, const SeenImage& seen) noexcept;
  void end_frame(Voxel& voxel, const SeenImage& seen) noexcept;
  /// Whether the image shows a surface around a cell that noise spreads over more cells than one along the ray.
  bool is_seen_around(const Voxel& voxel, const SeenImage& seen) const noexcept;
  /// What an image says of a cell that it did not show; `surface`: its depth is that of the cell, but for noise.
  enum class Sight { elsewhere, hidden, surface, free };
  Sight sight(const Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) const noexcept;
  /// Number of samples of a cell, of five, that show a surface where the cell is, but for noise.
  int num_surface(const Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) const noexcept;
  void look_for(Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) noexcept;
  /// Whether something has been seen for long in the cell of a point.
  bool rests_at(const Eigen::Vector3d& point) const noexcept;
  /// Lets its box shrink to what an image at a time shows, and extends it.
  void take_box(Voxel& voxel, double time) const noexcept;
  void remove(Voxel& voxel) noexcept;

  PerceptionSettings settings_;
  VoxelGrid grid_;
  std::vector<int> index_;  // Index of the voxel of each cell; -1: none.
  std::vector<Voxel> voxels_;
  std::vector<int> unused_;                   // Indices of voxels that are not in use.
  std::vector<int> touched_;                  // Indices of those that the image showed.
  std::vector<float> row_x_, row_y_, row_z_;  // Points of a row of pixels [m], in the world.
  std::vector<int> row_cells_;                // Their cells.
  BesideArm beside_arm_;                      // in the image
  std::uint32_t frame_ = 0;
};

}  // namespace sidestep
