#pragma once

#include <Eigen/Core>
#include <vector>

namespace sidestep {

struct CoverBall {
  Eigen::Vector3d centre;
  double radius;
};

/// Balls whose union holds the ellipsoid {m + Aᵀ y : Σ y_i² / a_i² ≤ 1}, with A's rows the principal axes and `squares`
/// the a_i², ascending [m²].
///
/// The two longer axes are cut into pieces. Above the piece [x₀, x₁] × [y₀, y₁], with centre (x_c, y_c), a ball around
/// it holds what is as far as
///
///     r² = max (x − x_c)² + (y − y_c)² + a_1² (1 − x²/a_3² − y²/a_2²),
///
/// which is convex in x and in y: the maximum is at a corner. Pieces are as short as balls overshoot by about
/// `overshoot` [m], but no more than 8 along an axis. What is outside all balls is as far from the ellipsoid, at least,
/// as from the nearest ball; how deep something is inside the ellipsoid they do not tell.
std::vector<CoverBall> cover_by_balls(const Eigen::Vector3d& mean, const Eigen::Matrix3d& axes, const Eigen::Vector3d& squares,
                                      double overshoot);

}  // namespace sidestep
