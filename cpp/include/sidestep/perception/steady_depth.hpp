#pragma once

#include <cstddef>
#include <vector>

#include "sidestep/perception/depth_camera.hpp"
#include "sidestep/perception/depth_image.hpp"

namespace sidestep {

/// Depths of a camera that stands still, with less noise: each pixel that shows an obstacle has the mean m of its last images.
///
/// m <- m + (z - m)/n, with n the number of images, at most the most. Another surface, |z - m| > 4 sigma(z), counts at once as it is; in
/// two images in a row it begins a new mean (n = 1). The mean also waits while the arm hides the pixel, or it shows nothing. A depth that
/// stays on one side of the mean, by 1.2 sigma over about seven images, is a surface that moves: m goes half of the way (n = 2). Before
/// n = 5 the depth itself counts. So a surface that moves by 1 sigma or more from image to image is not averaged, and a slower one is shown
/// less than 2 sigma behind where it is.
///
/// Neighbours see a slow motion sooner than one pixel does. The differences of a tile of 8 x 8 pixels have a mean d. The surface in the
/// tile moves if |d| is beyond 0.25 sigma and beyond six times the median of all tiles, or beyond 0.8 sigma in any case. Its means are
/// then shifted by the mean of z - m. A surface that covers whole tiles is so shown less than 0.9 sigma behind; one of 15 x 15 pixels does.
class SteadyDepth {
 public:
  SteadyDepth(const DepthCamera& camera, int most_images);

  /// Takes an image over. No allocation.
  void add(const DepthCamera& camera, const DepthImage& image) noexcept;
  void forget() noexcept;
  const float* depth() const noexcept { return steady_.data(); }  ///< [m], of the pixels of the last image

 private:
  bool has_mean(const PixelLabel* labels, std::size_t i) const noexcept {
    return labels[i] == PixelLabel::obstacle && images_[i] > 1.0f;
  }
  /// Shifts the means of tiles whose surface moves.
  void follow_tiles(const DepthCamera& camera, const DepthImage& image) noexcept;
  /// Finds the mean difference of each tile [sigma]; returns that from which on a tile moves.
  float find_tiles(const DepthImage& image) noexcept;
  /// Shifts the means of the surface in one tile that moves.
  void follow(const DepthCamera& camera, const DepthImage& image, int left, int top) noexcept;

  float most_, least_;  // images of a mean, and from which on it counts
  int width_;
  std::vector<float> mean_, images_, drift_, steady_;
  std::vector<float> sums_, counts_;         // of the differences of a row of tiles, by columns of pixels: in work
  std::vector<float> tiles_, sorted_tiles_;  // Mean difference of each tile [sigma], and their sizes: in work.
};

}  // namespace sidestep
