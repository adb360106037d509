#include "registration.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sidestep {
namespace {

constexpr double trimmed = 2.5;          // Multiple of the median distance beyond which a pair does not count [-].
constexpr double exact = 0.001;          // Distance that is never trimmed [m].
constexpr double settled = 1e-4;         // Step that is the last [m].
constexpr double slowest_series = 0.85;  // Largest ratio of steps that is summed up to infinity.

constexpr double nearer = 2.0;  // Ratio of the errors of points to the distances of the nearest ones, at most.
constexpr double better_ratio = 1.3,
                 better_by = 0.02;  // Least gain of a motion over rest, as ratio and difference of their costs.

struct Offsets {
  std::vector<Eigen::Vector3d> each;  // place of the nearest point − place of the point moved [m]
  std::vector<double> distances;      // [m]
  double cost = 0.0;
  int in_sight = 0;  // number of points
};

Offsets offsets_of(const Eigen::Matrix3Xd& points, const PointGrid& earlier, const Eigen::Vector3d& shift, const Sight& sight) {
  Offsets found;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d place = points.col(n) + shift;
    if (sight && !sight(place)) {
      continue;
    }
    ++found.in_sight;
    const PointGrid::Nearest nearest = earlier.nearest(place);
    if (nearest.point >= 0) {
      found.each.push_back(earlier.point(nearest.point) - place);
      found.distances.push_back(nearest.distance);
    }
    found.cost += nearest.distance * nearest.distance / (PointGrid::edge * PointGrid::edge);
  }
  found.cost /= std::max(1, found.in_sight);
  return found;
}

/// The mean of what is not trimmed; `deviation`: of that mean.
Eigen::Vector3d trimmed_mean(const Offsets& offsets, double& deviation) {
  std::vector<double> sorted = offsets.distances;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double limit = trimmed * *middle + exact;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0.0;
  int num = 0;
  for (std::size_t n = 0; n < offsets.each.size(); ++n) {
    if (offsets.distances[n] <= limit) {
      sum += offsets.each[n];
      squares += offsets.each[n].squaredNorm();
      ++num;
    }
  }
  deviation = nearer * std::sqrt(squares / 3.0) / num;
  return sum / num;
}

}  // namespace

Registration register_points(const Eigen::Matrix3Xd& points, const PointGrid& earlier, const Eigen::Vector3d& start,
                             int iterations, const Sight& sight) {
  Registration result{.shift = start};
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int i = 0;; ++i) {
    const Offsets offsets = offsets_of(points, earlier, result.shift, sight);
    if (offsets.each.empty() || (sight && offsets.in_sight < few_in_sight)) {
      return {.shift = result.shift};
    }
    result.found = static_cast<double>(offsets.each.size()) / offsets.in_sight;
    result.cost = offsets.cost;
    Eigen::Vector3d step = trimmed_mean(offsets, result.error);
    if (i >= iterations || step.norm() < settled) {
      return result;
    }
    const double ratio = before.squaredNorm() > 0.0 ? step.dot(before) / before.squaredNorm() : 0.0;
    before = step;
    if (ratio > 0.0 && ratio < slowest_series) {
      step /= 1.0 - ratio;
      before.setZero();
    }
    result.shift += step;
  }
}

Registration register_points(const Eigen::Matrix3Xd& points, const PointGrid& earlier, const std::vector<Start>& starts,
                             int iterations, const Sight& sight) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double least = register_points(points, earlier, best, 1, sight).cost / better_ratio;
  for (const Start& start : starts) {
    const double more = start.goes_on ? 0.0 : better_by;
    const double cost = least > more ? register_points(points, earlier, start.shift, 1, sight).cost + more : 1.0;
    if (cost < least) {
      least = cost;
      best = start.shift;
    }
  }
  return register_points(points, earlier, best, iterations, sight);
}

}  // namespace sidestep
