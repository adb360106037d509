#include "image_sight.hpp"

#include <algorithm>
#include <limits>

namespace sidestep {
namespace {

constexpr int edge = 8;  // of a block [pixel]
constexpr int step = 2;  // from one pixel that is looked at to the next

}  // namespace

ImageSight::ImageSight(const DepthCamera& camera, const Eigen::Isometry3d& X_WC, const DepthImage& image, const float* front)
    : camera_(&camera), X_CW_(X_WC.inverse()), columns_((image.width() + edge - 1) / edge) {
  const int rows = (image.height() + edge - 1) / edge;
  farthest_.reserve(static_cast<std::size_t>(columns_ * rows));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const int u1 = std::min(image.width(), (column + 1) * edge), v1 = std::min(image.height(), (row + 1) * edge);
      int num = 0, hidden = 0;
      float nearest = std::numeric_limits<float>::infinity();
      bool is_arm = false;
      for (int v = row * edge; v < v1; v += step) {
        for (int u = column * edge; u < u1; u += step) {
          const std::ptrdiff_t i = static_cast<std::ptrdiff_t>(v) * image.width() + u;
          const PixelLabel label = image.labels()[i];
          ++num;  // beside the arm there are pixels without depths, too
          hidden += label == PixelLabel::arm || !has_surface(label) ? 1 : 0;
          if (label == PixelLabel::arm) {
            is_arm = true;
            nearest = std::min(nearest, front[i]);
          }
        }
      }
      farthest_.push_back(is_arm && 2 * hidden >= num ? nearest : std::numeric_limits<float>::infinity());
    }
  }
}

bool ImageSight::shows(const Eigen::Vector3d& place) const noexcept {
  const Eigen::Vector3d p = X_CW_ * place;
  if (!(p.z() >= camera_->near && p.z() <= camera_->far)) {
    return false;
  }
  const Eigen::Vector2d at = camera_->project(p);
  if (!(at.x() >= 0.0 && at.y() >= 0.0 && at.x() <= camera_->width - 1 && at.y() <= camera_->height - 1)) {
    return false;
  }
  const int block = static_cast<int>(at.y()) / edge * columns_ + static_cast<int>(at.x()) / edge;
  return p.z() < static_cast<double>(farthest_[static_cast<std::size_t>(block)]);
}

}  // namespace sidestep
