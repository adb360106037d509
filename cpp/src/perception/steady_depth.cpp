#include "sidestep/perception/steady_depth.hpp"

#include <algorithm>
#include <array>
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

float constant_noise(const DepthCamera& camera) noexcept { return static_cast<float>(camera.noise.constant) + least_noise; }
float quadratic_noise(const DepthCamera& camera) noexcept { return static_cast<float>(camera.noise.quadratic); }

int tiles_across(int pixels) noexcept { return (pixels + tile - 1) / tile; }

/// Adds the differences of a row of pixels that have a mean, and their number, to those of their columns.
void add_row(const PixelLabel* __restrict__ labels, const float* __restrict__ images, const float* __restrict__ drift,
             std::size_t width, float* __restrict__ sums, float* __restrict__ counts) noexcept {
  for (std::size_t u = 0; u < width; ++u) {
    const float share = labels[u] == PixelLabel::obstacle && images[u] > 1.0f ? 1.0f : 0.0f;
    sums[u] += share * drift[u];
    counts[u] += share;
  }
}

}  // namespace

SteadyDepth::SteadyDepth(const DepthCamera& camera, int most_images)
    : most_(static_cast<float>(most_images)),
      least_(std::min(steady_after, most_)),
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
  const kernels::SteadyRule rule{constant_noise(camera),
                                 quadratic_noise(camera),
                                 jump,
                                 drift,
                                 most_,
                                 least_,
                                 static_cast<unsigned char>(PixelLabel::obstacle)};
  SIDESTEP_KERNEL_IN_USE(kernels::image_kernel)().steady(
      rule, image.depth(), reinterpret_cast<const unsigned char*>(image.labels()), static_cast<int>(image.size()), mean_.data(),
      images_.data(), drift_.data(), steady_.data());
  follow_tiles(camera, image);
}

void SteadyDepth::follow_tiles(const DepthCamera& camera, const DepthImage& image) noexcept {
  const float limit = find_tiles(image);
  const int across = tiles_across(width_);
  for (int top = 0; top < image.height(); top += tile) {
    for (int left = 0; left < width_; left += tile) {
      if (tiles_[static_cast<std::size_t>(top / tile * across + left / tile)] > limit) {
        follow(camera, image, left, top);
      }
    }
  }
}

float SteadyDepth::find_tiles(const DepthImage& image) noexcept {
  const std::size_t width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(image.height());
  std::size_t next = 0, num = 0;
  for (std::size_t top = 0; top < height; top += tile) {
    std::fill(sums_.begin(), sums_.end(), 0.0f);
    std::fill(counts_.begin(), counts_.end(), 0.0f);
    for (std::size_t v = top; v < std::min(top + tile, height); ++v) {
      add_row(image.labels() + v * width, images_.data() + v * width, drift_.data() + v * width, width, sums_.data(),
              counts_.data());
    }
    for (auto sum = sums_.begin(), count = counts_.begin(); sum != sums_.end(); sum += tile, count += tile) {
      const float pixels = std::accumulate(count, count + tile, 0.0f);
      const bool shows = pixels >= least_in_tile;
      const float mean = shows ? std::abs(std::accumulate(sum, sum + tile, 0.0f)) / pixels : 0.0f;
      tiles_[next++] = mean;
      if (shows) {
        sorted_tiles_[num++] = mean;
      }
    }
  }
  const auto middle = sorted_tiles_.begin() + static_cast<std::ptrdiff_t>(num / 2);
  std::nth_element(sorted_tiles_.begin(), middle, sorted_tiles_.begin() + static_cast<std::ptrdiff_t>(num));
  return num == 0 ? least_drift : std::clamp(beyond_most * *middle, least_drift, enough_drift);
}

void SteadyDepth::follow(const DepthCamera& camera, const DepthImage& image, int left, int top) noexcept {
  std::array<std::size_t, tile * tile> pixels;
  std::size_t num = 0;
  float mean = 0.0f;  // difference of the tile [sigma]
  for (int v = top; v < std::min(top + tile, image.height()); ++v) {
    for (int u = left; u < std::min(left + tile, width_); ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
      if (has_mean(image.labels(), i)) {
        pixels[num++] = i;
        mean += drift_[i];
      }
    }
  }
  mean /= static_cast<float>(num);
  // What moves is where most of the pixels are that differ as the tile does; another surface in the tile may rest.
  std::array<float, tile * tile> depths{};
  std::size_t num_moving = 0;
  for (std::size_t k = 0; k < num; ++k) {
    if (drift_[pixels[k]] * mean > 0.5f * mean * mean) {
      depths[num_moving++] = mean_[pixels[k]];
    }
  }
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(num_moving / 2);
  std::nth_element(depths.begin(), middle, depths.begin() + static_cast<std::ptrdiff_t>(num_moving));
  const float noise = constant_noise(camera) + quadratic_noise(camera) * *middle * *middle;
  const auto end = std::remove_if(pixels.begin(), pixels.begin() + static_cast<std::ptrdiff_t>(num),
                                  [&](std::size_t i) { return std::abs(mean_[i] - *middle) > jump * noise; });
  float way = 0.0f;
  std::for_each(pixels.begin(), end, [&](std::size_t i) { way += image.depth()[i] - mean_[i]; });
  way /= static_cast<float>(end - pixels.begin());
  std::for_each(pixels.begin(), end, [&](std::size_t i) {
    mean_[i] += way;
    drift_[i] -= mean;  // the pixel's own remains: a surface of few pixels is left to the rule of each
    steady_[i] = images_[i] >= least_ ? mean_[i] : image.depth()[i];
  });
}

void SteadyDepth::forget() noexcept { std::fill(images_.begin(), images_.end(), 0.0f); }

}  // namespace sidestep
