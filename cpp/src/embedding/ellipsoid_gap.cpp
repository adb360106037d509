#include "sidestep/embedding/ellipsoid_gap.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr int most_steps = 16;
// Of the slope of φ across n, relative to the lengths in it: n is as good, and h to the square of that.
constexpr double accuracy = 1e-13;
constexpr double rounding = 1e-15;  // of φ, relative to the lengths in it
// Centres closer than this have no direction between them [m]; such ellipsoids overlap deeply anyway.
constexpr double closest_centres = 1e-6;

/// Two unit vectors across n: one away from the axis that n is nearest to.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& n) noexcept {
  Eigen::Index axis;
  n.cwiseAbs().minCoeff(&axis);
  Eigen::Matrix<double, 3, 2> T;
  T.col(0) = n.cross(Eigen::Vector3d::Unit(axis)).normalized();
  T.col(1) = n.cross(T.col(0));
  return T;
}

Eigen::Vector2d solve(const Eigen::Matrix2d& M, const Eigen::Vector2d& b) noexcept {
  return Eigen::Vector2d(M(1, 1) * b[0] - M(0, 1) * b[1], M(0, 0) * b[1] - M(1, 0) * b[0]) /
         (M(0, 0) * M(1, 1) - M(0, 1) * M(1, 0));
}

}  // namespace

Eigen::Vector3d EllipsoidGap::turn(const Eigen::Vector3d& gradient_rate) const noexcept {
  return tangents * solve(curvature, tangents.transpose() * gradient_rate);
}

EllipsoidGap ellipsoid_gap(const Eigen::Vector3d& d, const Eigen::Matrix3d& S_a, const Eigen::Matrix3d& S_b) noexcept {
  const double length = d.norm();
  EllipsoidGap gap;
  gap.normal = length > closest_centres ? Eigen::Vector3d(d / length) : Eigen::Vector3d::UnitX();
  Eigen::Vector3d p_a, p_b;
  double s_a, s_b;
  const auto phi = [&](const Eigen::Vector3d& n) noexcept {
    p_a = S_a * n;
    p_b = S_b * n;
    s_a = std::sqrt(n.dot(p_a));
    s_b = std::sqrt(n.dot(p_b));
    return n.dot(d) - s_a - s_b;
  };
  gap.value = phi(gap.normal);
  for (int step = 0;; ++step) {
    // Of unit vectors near n: the slope of φ across it, and the second derivative −H − φ I.
    const Eigen::Matrix<double, 3, 2> T = across(gap.normal);
    const Eigen::Vector2d slope = T.transpose() * (d - p_a / s_a - p_b / s_b);
    const Eigen::Vector2d k_a = T.transpose() * p_a / s_a, k_b = T.transpose() * p_b / s_b;
    Eigen::Matrix2d H = T.transpose() * (S_a / s_a + S_b / s_b).lazyProduct(T);
    H -= k_a * k_a.transpose() / s_a + k_b * k_b.transpose() / s_b;
    // Ellipsoids that overlap more deeply than they are curved have no maximum here: a definite matrix leads upwards.
    const double mean = 0.5 * H.trace(), spread = std::hypot(0.5 * (H(0, 0) - H(1, 1)), H(0, 1));
    gap.tangents = T;
    gap.curvature = H + std::max(gap.value, -0.5 * (mean - spread)) * Eigen::Matrix2d::Identity();
    if (step == most_steps || slope.squaredNorm() <= std::pow(accuracy * (length + s_a + s_b), 2)) {
      return gap;
    }
    const Eigen::Vector3d along = T * solve(gap.curvature, slope);
    double share = 1.0, value = gap.value;
    Eigen::Vector3d n = gap.normal;
    for (int halving = 0; halving < 8; ++halving, share *= 0.5) {
      n = (gap.normal + share * along).normalized();
      value = phi(n);
      if (value >= gap.value - rounding * (length + s_a + s_b)) {  // near the maximum its slope says more than φ
        break;
      }
    }
    gap.normal = n;
    gap.value = value;
  }
}

}  // namespace sidestep
