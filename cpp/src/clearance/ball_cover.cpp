#include "sidestep/clearance/ball_cover.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {

std::vector<CoverBall> cover_by_balls(const Eigen::Vector3d& mean, const Eigen::Matrix3d& axes, const Eigen::Vector3d& squares,
                                      double overshoot) {
  const Eigen::Vector3d a = squares.cwiseSqrt();
  // Half a piece h in both directions raises the radius from a_1 to √(a_1² + 2 h²).
  const double half = std::sqrt(0.5 * overshoot * (2.0 * a[0] + overshoot));
  const auto pieces = [&](double length) { return std::clamp(static_cast<int>(std::ceil(length / half)), 1, 8); };
  // An axis hardly longer than the shortest need not be cut.
  const auto whole = [&](double length) { return length < a[0] + overshoot; };
  const int along = whole(a[2]) ? 1 : pieces(a[2]), across = whole(a[1]) ? 1 : pieces(a[1]);
  std::vector<CoverBall> balls;
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < across; ++j) {
      const double x[2] = {a[2] * (2.0 * i / along - 1.0), a[2] * (2.0 * (i + 1) / along - 1.0)};
      const double y[2] = {a[1] * (2.0 * j / across - 1.0), a[1] * (2.0 * (j + 1) / across - 1.0)};
      const auto nearest = [](const double (&ends)[2]) { return std::clamp(0.0, ends[0], ends[1]); };
      if (nearest(x) * nearest(x) / squares[2] + nearest(y) * nearest(y) / squares[1] >= 1.0) {
        continue;  // beside the ellipsoid
      }
      const double xc = 0.5 * (x[0] + x[1]), yc = 0.5 * (y[0] + y[1]);
      double largest = 0.0;
      for (const double u : x) {
        for (const double v : y) {
          largest = std::max(largest, (u - xc) * (u - xc) + (v - yc) * (v - yc) +
                                          squares[0] * (1.0 - u * u / squares[2] - v * v / squares[1]));
        }
      }
      balls.push_back({mean + axes.transpose() * Eigen::Vector3d(0.0, yc, xc), std::sqrt(largest)});
    }
  }
  return balls;
}

}  // namespace sidestep
