#include "sidestep/perception/beside_arm.hpp"

#include <algorithm>
#include <cstring>

namespace sidestep {
namespace {

constexpr int widest_shadow = 16;  // Pixels without depth beside the arm, at most: one of two eyes does not see there.
constexpr int reach = widest_shadow + 1;

/// Whether the arm is next to a pixel in a direction, or beyond pixels that fly beside it or have no depth.
bool meets_arm(const DepthImage& image, int u, int v, int step_u, int step_v) noexcept {
  for (int n = 0; n < reach; ++n) {
    u += step_u;
    v += step_v;
    if (u < 0 || v < 0 || u >= image.width() || v >= image.height()) {
      return false;
    }
    const PixelLabel label = image.labels()[static_cast<std::ptrdiff_t>(v) * image.width() + u];
    if (has_surface(label)) {
      return label == PixelLabel::arm;
    }
  }
  return false;
}

}  // namespace

void BesideArm::take(const DepthImage& image) {
  const int height = image.height();
  const auto rows = static_cast<std::size_t>(height);
  own_.resize(rows);
  near_.assign(rows, Columns{});
  for (int v = 0; v < height; ++v) {
    const PixelLabel* const row = image.labels() + static_cast<std::ptrdiff_t>(v) * image.width();
    Columns& own = own_[static_cast<std::size_t>(v)] = {};
    const void* const found = std::memchr(row, static_cast<int>(PixelLabel::arm), static_cast<std::size_t>(image.width()));
    if (found != nullptr) {
      own.first = static_cast<int>(static_cast<const PixelLabel*>(found) - row);
      own.last = image.width() - 1;
      while (row[own.last] != PixelLabel::arm) {
        --own.last;
      }
    }
  }
  for (int v = 0; v < height; ++v) {
    const Columns& own = own_[static_cast<std::size_t>(v)];
    for (int row = std::max(0, v - reach); own.first <= own.last && row <= std::min(height - 1, v + reach); ++row) {
      Columns& near = near_[static_cast<std::size_t>(row)];
      near.first = std::min(near.first, own.first - reach);
      near.last = std::max(near.last, own.last + reach);
    }
  }
}

bool BesideArm::is_beside(const DepthImage& image, int v, int first, int last) const noexcept {
  const Columns& near = near_[static_cast<std::size_t>(v)];
  if (last < near.first || first > near.last) {
    return false;
  }
  const int middle = (first + last) / 2;
  return meets_arm(image, first, v, -1, 0) || meets_arm(image, last, v, 1, 0) || meets_arm(image, middle, v, 0, -1) ||
         meets_arm(image, middle, v, 0, 1);
}

}  // namespace sidestep
