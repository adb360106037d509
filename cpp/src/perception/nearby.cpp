#include "nearby.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidestep {
namespace {

/// Distances of balls and boxes from a point, for PointTree::nearest.
struct FromPoint {
  Eigen::Vector3d p;

  unsigned operator()(const Balls& balls, int first, int count, double limit, float* values) const noexcept {
    unsigned bits = 0;
    for (int n = 0; n < count; ++n) {
      const int i = first + n;
      const double dx = balls.x[i] - p.x(), dy = balls.y[i] - p.y(), dz = balls.z[i] - p.z();
      const double distance = std::sqrt(dx * dx + dy * dy + dz * dz) - balls.radius[i];
      values[n] = static_cast<float>(distance);
      bits |= distance < limit ? 1u << n : 0u;
    }
    return bits;
  }
  unsigned operator()(const Boxes& boxes, int first, int count, double limit, float* values) const noexcept {
    unsigned bits = 0;
    for (int n = 0; n < count; ++n) {
      const int i = first + n;
      const double dx = std::max(0.0, std::abs(boxes.x[i] - p.x()) - boxes.half_x[i]);
      const double dy = std::max(0.0, std::abs(boxes.y[i] - p.y()) - boxes.half_y[i]);
      const double dz = std::max(0.0, std::abs(boxes.z[i] - p.z()) - boxes.half_z[i]);
      const double distance = std::sqrt(dx * dx + dy * dy + dz * dz) - boxes.radius[i];
      values[n] = static_cast<float>(distance);
      bits |= distance < limit ? 1u << n : 0u;
    }
    return bits;
  }
};

}  // namespace

double distance_to(const Obstacles& obstacles, const Eigen::Vector3d& point, double beyond) noexcept {
  return obstacles.size() == 0
             ? beyond
             : obstacles.tree().nearest(beyond, -std::numeric_limits<double>::infinity(), FromPoint{point}).distance;
}

}  // namespace sidestep
