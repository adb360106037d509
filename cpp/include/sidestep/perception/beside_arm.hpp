#pragma once

#include <limits>
#include <vector>

#include "sidestep/perception/depth_image.hpp"

namespace sidestep {

/// Which pixels of an image are beside the arm: next to its pixels, or with nothing in between but up to 16 that fly or have no depth.
class BesideArm {
 public:
  /// Takes over where the arm is in an image. May allocate at the first one of its size.
  void take(const DepthImage& image);

  /// Whether a run of pixels, from a first to a last column of row v of that image, is beside the arm: at an end, or above or below its middle.
  bool is_beside(const DepthImage& image, int v, int first, int last) const noexcept;

 private:
  struct Columns {
    int first = std::numeric_limits<int>::max(), last = -1;  // none
  };
  std::vector<Columns> own_, near_;  // per row: between which the arm is, and is so near that it can be met
};

}  // namespace sidestep
