#pragma once

#include <Eigen/Core>

namespace sidestep {

/// A ball that holds the box of a voxel.
struct CellBall {
  Eigen::Vector3d centre;
  double radius;
};

/// The ball around a box whose middle is pushed away from the camera by `depth`: it holds the box all the same, and stands out of it less on
/// the side that is seen, by sqrt(h² + depth²) - depth in place of h for a box with the half diagonal h in that plane.
///
/// A box that is thin along an axis holds a surface across that axis, and is pushed along it; another one along the ray.
CellBall ball_behind(const Eigen::Vector3d& middle, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                     const Eigen::Vector3d& eye, double depth);

/// The smallest ball with centre and radius in single precision that holds a ball, around its centre rounded: recordings keep half as
/// many bytes of it.
CellBall in_single_precision(const CellBall& ball);

}  // namespace sidestep
