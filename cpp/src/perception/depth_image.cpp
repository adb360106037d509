#include "sidestep/perception/depth_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>

#include "../math/kernels/in_use.hpp"
#include "kernels/image_kernel.hpp"

namespace sidestep {
namespace {

constexpr float slope_share = 0.03f;   // Difference of neighbouring depths on a slanted surface, as a share of the depth.
constexpr float noise_reach = 4.0f;    // The same by noise, in standard deviations.
constexpr float least_support = 1.5f;  // Neighbours on the same surface, below which a pixel is flying: two count.
constexpr int edge_reach = 2;          // Pixels from the arm within which one may mix its depth with another.

void check_size(const DepthCamera& camera, std::size_t size) {
  const auto expected = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  if (size != expected) {
    throw std::invalid_argument("camera '" + camera.name + "': the image has " + std::to_string(size) +
                                " pixels, allowed: " + std::to_string(camera.width) + " × " + std::to_string(camera.height));
  }
}

constexpr float farthest = 100.0f;  // Depth above which no camera sees [m]: floats in millimetres are nothing.

/// Depth in metres, 0 where nothing was seen or it is too near.
void convert(const float* raw, float unit, float low, std::size_t size, float* depth) noexcept {
  for (std::size_t i = 0; i < size; ++i) {
    const float z = raw[i] * unit;
    depth[i] = z >= low && z <= farthest ? z : 0.0f;
  }
}
void convert(const std::uint16_t* raw, float unit, float low, std::size_t size, float* depth) noexcept {
  for (std::size_t i = 0; i < size; ++i) {
    const float z = static_cast<float>(static_cast<int>(raw[i])) * unit;
    depth[i] = z >= low ? z : 0.0f;
  }
}

}  // namespace

DepthImage::DepthImage(const DepthCamera& camera)
    : width_(camera.width),
      height_(camera.height),
      depth_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      tolerance_(static_cast<std::size_t>(camera.width)),
      support_(tolerance_.size()),
      others_(tolerance_.size()),
      arm_in_column_(tolerance_.size() + 2 * static_cast<std::size_t>(edge_reach)),
      beside_arm_(tolerance_.size()),
      labels_(depth_.size()) {}

void DepthImage::take(const DepthCamera& camera, const RawDepth& raw) {
  const auto low = static_cast<float>(camera.near);
  std::visit(
      [&](const auto& pixels) {
        check_size(camera, pixels.size());
        convert(pixels.data(), static_cast<float>(raw.unit), low, pixels.size(), depth_.data());
      },
      raw.pixels);
  mark_edges(camera);
}

void DepthImage::take(const DepthCamera& camera, const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  std::fill(depth_.begin(), depth_.end(), 0.0f);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d p = points.col(n);
    if (!(p.z() >= camera.near) || !p.allFinite()) {
      continue;
    }
    const Eigen::Vector2d pixel = camera.project(p);
    const double u = std::round(pixel.x()), v = std::round(pixel.y());
    if (u >= 0.0 && v >= 0.0 && u < width_ && v < height_) {
      float& depth = depth_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u)];
      const auto z = static_cast<float>(p.z());
      depth = depth > 0.0f ? std::min(depth, z) : z;
    }
  }
  mark_edges(camera);
}

void DepthImage::mark_edges(const DepthCamera& camera) noexcept {
  const auto constant = noise_reach * static_cast<float>(camera.noise.constant);
  const auto quadratic = noise_reach * static_cast<float>(camera.noise.quadratic);
  const auto far = static_cast<float>(camera.far);
  const kernels::ImageKernel kernel = SIDESTEP_KERNEL_IN_USE(kernels::image_kernel)();
  for (int v = 0; v < height_; ++v) {
    const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_);
    const float* const z = depth_.data() + row;
    for (int u = 0; u < width_; ++u) {
      tolerance_[static_cast<std::size_t>(u)] = z[u] > 0.0f ? constant + z[u] * (slope_share + quadratic * z[u]) : -1.0f;
      support_[static_cast<std::size_t>(u)] = others_[static_cast<std::size_t>(u)] = 0.0f;
    }
    for (int dv = -1; dv <= 1; ++dv) {
      if (v + dv < 0 || v + dv >= height_) {
        continue;
      }
      const float* const other = z + dv * width_;
      kernel.compare(z + 1, other, tolerance_.data() + 1, width_ - 1, support_.data() + 1, others_.data() + 1);
      kernel.compare(z, other + 1, tolerance_.data(), width_ - 1, support_.data(), others_.data());
      if (dv != 0) {
        kernel.compare(z, other, tolerance_.data(), width_, support_.data(), others_.data());
      }
    }
    PixelLabel* const label = labels_.data() + row;
    for (int u = 0; u < width_; ++u) {
      const std::size_t i = static_cast<std::size_t>(u);
      const bool flies = support_[i] < least_support && others_[i] > 0.0f;
      label[u] = !(z[u] > 0.0f) ? PixelLabel::nothing
                 : z[u] > far   ? PixelLabel::outside
                 : flies        ? PixelLabel::edge
                                : PixelLabel::obstacle;
    }
  }
}

bool DepthImage::find_beside_arm(int row) noexcept {
  std::fill(arm_in_column_.begin(), arm_in_column_.end(), static_cast<unsigned char>(0));
  const auto width = static_cast<std::size_t>(width_);
  bool is_near = false;
  for (int v = std::max(0, row - edge_reach); v <= std::min(height_ - 1, row + edge_reach); ++v) {
    const PixelLabel* const label = labels_.data() + static_cast<std::ptrdiff_t>(v) * width_;
    if (std::memchr(label, static_cast<int>(PixelLabel::arm), width) == nullptr) {
      continue;
    }
    is_near = true;
    unsigned char* const __restrict found = arm_in_column_.data() + edge_reach;
    for (std::size_t u = 0; u < width; ++u) {
      found[u] = label[u] == PixelLabel::arm ? static_cast<unsigned char>(1) : found[u];
    }
  }
  if (is_near) {
    const PixelLabel* const label = labels_.data() + static_cast<std::ptrdiff_t>(row) * width_;
    const unsigned char* const arm = arm_in_column_.data();
    unsigned char* const __restrict found = beside_arm_.data();
    static_assert(edge_reach == 2);
    for (std::size_t u = 0; u < width; ++u) {
      const auto beside = static_cast<unsigned char>(arm[u] | arm[u + 1] | arm[u + 2] | arm[u + 3] | arm[u + 4]);
      found[u] = label[u] == PixelLabel::obstacle ? beside : static_cast<unsigned char>(0);
    }
  }
  return is_near;
}

bool DepthImage::is_between(int u, int v, float noise, float slope) const noexcept {
  constexpr float inf = std::numeric_limits<float>::infinity();
  const float own = depth_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u)];
  float arm_low = inf, arm_high = 0.0f, low = inf, high = 0.0f;
  for (int row = std::max(0, v - edge_reach); row <= std::min(height_ - 1, v + edge_reach); ++row) {
    for (int column = std::max(0, u - edge_reach); column <= std::min(width_ - 1, u + edge_reach); ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column);
      const float z = depth_[i];
      if (!(z > 0.0f)) {
        continue;
      }
      const bool is_arm = labels_[i] == PixelLabel::arm;
      (is_arm ? arm_low : low) = std::min(is_arm ? arm_low : low, z);
      (is_arm ? arm_high : high) = std::max(is_arm ? arm_high : high, z);
    }
  }
  const bool is_behind_arm = own > arm_low + noise, is_before_arm = own < arm_high - noise;
  return (is_behind_arm && (is_before_arm || own < high - noise - slope)) || (is_before_arm && own > low + noise + slope);
}

void DepthImage::mark_edges_of_arm(const DepthCamera& camera) noexcept {
  const auto constant = noise_reach * static_cast<float>(camera.noise.constant);
  const auto quadratic = noise_reach * static_cast<float>(camera.noise.quadratic);
  for (int v = 0; v < height_; ++v) {
    if (!find_beside_arm(v)) {
      continue;
    }
    const unsigned char *const begin = beside_arm_.data(), *const end = begin + width_;
    const auto next = [end](const unsigned char* from) noexcept {
      return static_cast<const unsigned char*>(std::memchr(from, 1, static_cast<std::size_t>(end - from)));
    };
    for (const unsigned char* at = next(begin); at != nullptr; at = next(at + 1)) {
      const int u = static_cast<int>(at - begin);
      const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
      const float z = depth_[i];
      if (is_between(u, v, constant + quadratic * z * z, slope_share * z)) {
        labels_[i] = PixelLabel::edge;
      }
    }
  }
}

}  // namespace sidestep
