#include "sidestep/perception/steady_depth.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "../math/kernels/in_use.hpp"
#include "kernels/image_kernel.hpp"

namespace sidestep {
namespace {

constexpr float jump = 4.0f, drift = 1.2f;  // Differences that are no noise, see `SteadyRule` [sigma].
constexpr float steady_after = 5.0f;        // Images on one surface after which a pixel rests.
constexpr float least_noise = 1e-6f;        // of a camera that has none [m]
constexpr int tile = 8;                     // Edge of a tile [pixels],
constexpr float least_in_tile = 16.0f;      // with so many pixels that have a mean, at least.
constexpr float beyond_most = 6.0f;         // Ratio of its difference to that of most tiles from which on it moves,
constexpr float least_drift = 0.25f;        // and that difference, at least,
constexpr float enough_drift = 0.8f;        // and in any case [sigma].

int tiles_across(int pixels) noexcept { return (pixels + tile - 1) / tile; }

}  // namespace

SteadyDepth::SteadyDepth(const DepthCamera& camera, int most_images)
    : most_(static_cast<float>(most_images)),
      width_(camera.width),
      mean_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0f),
      images_(mean_),
      drift_(mean_),
      steady_(mean_),
      sums_(static_cast<std::size_t>(tile * tiles_across(camera.width)), 0.0f),
      counts_(sums_),
      tiles_(static_cast<std::size_t>(tiles_across(camera.width)) * static_cast<std::size_t>(tiles_across(camera.height)),
             0.0f),
      sorted_tiles_(tiles_) {}

void SteadyDepth::add(const DepthCamera& camera, const DepthImage& image) noexcept {
  static_assert(sizeof(PixelLabel) == 1);
  const kernels::SteadyRule rule{static_cast<float>(camera.noise.constant) + least_noise,
                                 static_cast<float>(camera.noise.quadratic),
                                 jump,
                                 drift,
                                 most_,
                                 std::min(steady_after, most_),
                                 static_cast<unsigned char>(PixelLabel::obstacle)};
  SIDESTEP_KERNEL_IN_USE(kernels::image_kernel)().steady(
      rule, image.depth(), reinterpret_cast<const unsigned char*>(image.labels()), static_cast<int>(image.size()), mean_.data(),
      images_.data(), drift_.data(), steady_.data());
  begin_moving_tiles(image);
}

void SteadyDepth::begin_moving_tiles(const DepthImage& image) noexcept {
  const int height = image.height(), across = tiles_across(width_);
  const PixelLabel* const labels = image.labels();
  const auto has_mean = [&](std::size_t i) { return labels[i] == PixelLabel::obstacle && images_[i] > 1.0f; };
  std::size_t num = 0;
  for (int top = 0; top < height; top += tile) {
    std::fill(sums_.begin(), sums_.end(), 0.0f);
    std::fill(counts_.begin(), counts_.end(), 0.0f);
    for (int v = top; v < std::min(top + tile, height); ++v) {
      const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_);
      for (std::size_t u = 0; u < static_cast<std::size_t>(width_); ++u) {
        const float share = has_mean(row + u) ? 1.0f : 0.0f;
        sums_[u] += share * drift_[row + u];
        counts_[u] += share;
      }
    }
    for (int k = 0; k < across; ++k) {
      const auto first = static_cast<std::ptrdiff_t>(k * tile);
      const float sum = std::accumulate(sums_.begin() + first, sums_.begin() + first + tile, 0.0f),
                  count = std::accumulate(counts_.begin() + first, counts_.begin() + first + tile, 0.0f);
      const float mean = count >= least_in_tile ? std::abs(sum) / count : 0.0f;
      tiles_[static_cast<std::size_t>(top / tile * across + k)] = mean;
      if (mean > 0.0f) {
        sorted_tiles_[num++] = mean;
      }
    }
  }
  if (num == 0) {
    return;
  }
  const auto middle = sorted_tiles_.begin() + static_cast<std::ptrdiff_t>(num / 2);
  std::nth_element(sorted_tiles_.begin(), middle, sorted_tiles_.begin() + static_cast<std::ptrdiff_t>(num));
  const float limit = std::clamp(beyond_most * *middle, least_drift, enough_drift);
  for (int v = 0; v < height; ++v) {
    const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_);
    for (int u = 0; u < width_; ++u) {
      const std::size_t i = row + static_cast<std::size_t>(u);
      if (tiles_[static_cast<std::size_t>(v / tile * across + u / tile)] > limit && has_mean(i)) {
        const float z = image.depth()[i];
        mean_[i] += 0.5f * (z - mean_[i]);
        images_[i] = 2.0f;
        drift_[i] = 0.0f;
        steady_[i] = z;
      }
    }
  }
}

void SteadyDepth::forget() noexcept { std::fill(images_.begin(), images_.end(), 0.0f); }

}  // namespace sidestep
