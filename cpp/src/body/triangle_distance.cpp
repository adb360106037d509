#include "sidestep/body/triangle_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

double squared_segment_distance(const Eigen::Vector3d& point, const Eigen::Vector3d& start,
                                const Eigen::Vector3d& end) noexcept {
  const Eigen::Vector3d along = end - start, from_start = point - start;
  const double length = along.squaredNorm();
  const double share = length > 0.0 ? std::clamp(from_start.dot(along) / length, 0.0, 1.0) : 0.0;
  return (from_start - share * along).squaredNorm();
}

}  // namespace

double triangle_distance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) noexcept {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = point - a, normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (area > 0.0) {
    const double v = ap.cross(ac).dot(normal) / area, w = ab.cross(ap).dot(normal) / area;
    if (v >= 0.0 && w >= 0.0 && v + w <= 1.0) {
      return std::abs(ap.dot(normal)) / std::sqrt(area);
    }
  }
  return std::sqrt(std::min(
      {squared_segment_distance(point, a, b), squared_segment_distance(point, b, c), squared_segment_distance(point, c, a)}));
}

Eigen::VectorXd nearest_triangle_distances(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& corners,
                                           const std::vector<int>& candidates) {
  const auto num = static_cast<std::size_t>(points.cols());
  const auto num_triangles = static_cast<int>(corners.cols() / 3);
  if (corners.cols() % 3 != 0 || (num > 0 && candidates.size() % num != 0)) {
    throw std::invalid_argument("there are " + std::to_string(candidates.size()) + " candidates of " + std::to_string(num) +
                                " points and " + std::to_string(corners.cols()) +
                                " corners; allowed: as many for each point, and 3");
  }
  const std::size_t each = num > 0 ? candidates.size() / num : 0;
  Eigen::VectorXd distances = Eigen::VectorXd::Constant(points.cols(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < num; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    for (std::size_t n = 0; n < each; ++n) {
      const int triangle = candidates[i * each + n];
      if (triangle < 0 || triangle >= num_triangles) {
        throw std::invalid_argument("candidate " + std::to_string(triangle) + " is none of the " +
                                    std::to_string(num_triangles) + " triangles");
      }
      const Eigen::Index first = 3 * static_cast<Eigen::Index>(triangle);
      distances[at] = std::min(
          distances[at], triangle_distance(points.col(at), corners.col(first), corners.col(first + 1), corners.col(first + 2)));
    }
  }
  return distances;
}

}  // namespace sidestep
