#include "sidestep/perception/steady_depth.hpp"

#include <algorithm>

#include "../math/kernels/in_use.hpp"
#include "kernels/image_kernel.hpp"

namespace sidestep {
namespace {

constexpr float jump = 4.0f, drift = 1.2f;  // Differences that are no noise, see `SteadyRule` [sigma].
constexpr float steady_after = 5.0f;        // Images on one surface after which a pixel rests.
constexpr float least_noise = 1e-6f;        // of a camera that has none [m]

}  // namespace

SteadyDepth::SteadyDepth(const DepthCamera& camera, int most_images)
    : most_(static_cast<float>(most_images)),
      mean_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0f),
      images_(mean_),
      drift_(mean_),
      steady_(mean_) {}

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
}

void SteadyDepth::forget() noexcept { std::fill(images_.begin(), images_.end(), 0.0f); }

}  // namespace sidestep
