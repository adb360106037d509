#include "cell_ball.hpp"

#include <bit>
#include <cstdint>

namespace sidestep {
namespace {

constexpr double thin_share = 0.5;  // Size of a box along one axis that is a surface across it, as a share of the others.
constexpr std::uint64_t beyond_single = 0x1fffffff;  // Bits of a number that one in single precision does not have.

/// The number without these bits, after `more` was added to its magnitude. (GCC 12 drops casts to float and back in vectors.)
double without_last_bits(double value, std::uint64_t more) noexcept {
  return std::bit_cast<double>((std::bit_cast<std::uint64_t>(value) + more) & ~beyond_single);
}

}  // namespace

CellBall ball_behind(const Eigen::Vector3d& middle, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                     const Eigen::Vector3d& eye, double depth) {
  const Eigen::Vector3d size = high - low, ray = (middle - eye).normalized();
  Eigen::Index axis = 0;
  const double thin = size.minCoeff(&axis);
  Eigen::Vector3d away = ray;
  if (thin < thin_share * (size.sum() - thin) / 2.0) {
    away = Eigen::Vector3d::Unit(axis) * (ray[axis] < 0.0 ? -1.0 : 1.0);
  }
  const Eigen::Vector3d centre = middle + depth * away;
  return {centre, (centre - low).cwiseMax(high - centre).norm()};
}

CellBall in_single_precision(const CellBall& ball) {
  const Eigen::Vector3d centre = ball.centre.unaryExpr([](double x) { return without_last_bits(x, (beyond_single + 1) / 2); });
  return {centre, without_last_bits(ball.radius + (ball.centre - centre).norm(), beyond_single)};
}

}  // namespace sidestep
