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
/// Neighbours see a slow motion sooner than one pixel: where the differences of a tile of 8 x 8 pixels have a mean that is six times as
/// large as that of most tiles, and 0.25 sigma, all of it moves. A surface as large as a tile is so shown less than 0.8 sigma behind.
class SteadyDepth {
 public:
  SteadyDepth(const DepthCamera& camera, int most_images);

  /// Takes an image over. No allocation.
  void add(const DepthCamera& camera, const DepthImage& image) noexcept;
  void forget() noexcept;
  const float* depth() const noexcept { return steady_.data(); }  ///< [m], of the pixels of the last image

 private:
  /// Lets the means of tiles that move as a whole begin anew.
  void begin_moving_tiles(const DepthImage& image) noexcept;

  float most_;
  int width_;
  std::vector<float> mean_, images_, drift_, steady_;
  std::vector<float> sums_, counts_;         // of the differences of a row of tiles, by columns of pixels: in work
  std::vector<float> tiles_, sorted_tiles_;  // Mean difference of each tile [sigma], and their sizes: in work.
};

}  // namespace sidestep
