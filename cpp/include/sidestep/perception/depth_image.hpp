#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "sidestep/perception/depth_camera.hpp"

namespace sidestep {

/// What a pixel shows.
enum class PixelLabel : std::uint8_t {
  nothing,    ///< no depth, or one that is too near
  obstacle,   ///< something that is not the arm
  arm,        ///< the arm, or an object that it holds
  edge,       ///< a depth between two surfaces, which is on neither: a flying pixel
  explained,  ///< a shape that was told
  left_out,   ///< in a region that is left out
  outside,    ///< beyond the range of the camera, which sees to its end
};

/// Whether the depth of a pixel is that of a surface, the arm's included.
constexpr bool has_surface(PixelLabel label) noexcept { return label != PixelLabel::nothing && label != PixelLabel::edge; }

/// Depths as a camera gives them, row by row: numbers in units of `unit` [m], or metres. 0, NaN and infinity: nothing seen.
struct RawDepth {
  std::variant<std::span<const std::uint16_t>, std::span<const float>> pixels;
  double unit = 0.001;  ///< [m]; of whole numbers and of floats alike
};

/// An image of depths that were checked, and what its pixels show.
///
/// A pixel is flying where at least one of its eight neighbours has another depth and fewer than two have its own, but for noise and
/// slope: |z - z'| <= 4 σ(z) + 0.03 z. One whose neighbours show nothing is none. Flying pixels beside the arm may support each other; see
/// `mark_edges_of_arm`.
class DepthImage {
 public:
  explicit DepthImage(const DepthCamera& camera);

  /// Takes an image over. Throws std::invalid_argument where its size is another. No allocation.
  void take(const DepthCamera& camera, const RawDepth& raw);
  /// The same of points (3 × N) in the optical frame: each pixel takes the nearest.
  void take(const DepthCamera& camera, const Eigen::Ref<const Eigen::Matrix3Xd>& points);

  /// Marks flying pixels at the silhouette of the arm, once its pixels are marked.
  ///
  /// Within two pixels of them, an obstacle is flying where its depth is between that of the arm and that of another surface there:
  /// farther than one by 4 σ(z), nearer than the other by 4 σ(z), and by 0.03 z more where that one is not the arm. No allocation.
  void mark_edges_of_arm(const DepthCamera& camera) noexcept;

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  const float* depth() const noexcept { return depth_.data(); }  ///< [m], 0: nothing; may be beyond the range
  const PixelLabel* labels() const noexcept { return labels_.data(); }
  PixelLabel* labels() noexcept { return labels_.data(); }
  std::size_t size() const noexcept { return depth_.size(); }
  /// Number of pixels that show this.
  int count(PixelLabel label) const noexcept { return static_cast<int>(std::count(labels_.begin(), labels_.end(), label)); }

 private:
  void mark_edges(const DepthCamera& camera) noexcept;
  /// Finds the obstacles of a row that are within two pixels of the arm; false: the arm is not near.
  bool find_beside_arm(int row) noexcept;
  bool is_between(int u, int v, float noise, float slope) const noexcept;

  int width_, height_;
  std::vector<float> depth_;
  // Of one row: difference of depths on one surface [m], number of neighbours on it, and of those on another one.
  std::vector<float> tolerance_, support_, others_;
  // Of one row: 1 in columns where the arm is within two rows, with two columns more at either end, and at obstacles beside it.
  std::vector<unsigned char> arm_in_column_, beside_arm_;
  std::vector<PixelLabel> labels_;
};

}  // namespace sidestep
