#include "cell_ball.hpp"

namespace sidestep {
namespace {

constexpr double thin_share = 0.5;  // Size of a box along one axis that is a surface across it, as a share of the others.

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

}  // namespace sidestep
