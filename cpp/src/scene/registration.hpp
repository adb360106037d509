#pragma once

#include <Eigen/Core>
#include <vector>

#include "point_grid.hpp"
#include "sidestep/scene/velocity_estimate.hpp"

namespace sidestep {

/// Where points lay in an earlier set: the translation that brings them there.
struct Registration {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< place then − place now [m]
  double found = 0.0;                               ///< Share of the points with one of the earlier set within a cell there.
  double cost = 1.0;   ///< Mean of squared distances, in units of a cell's; 1 for points that were not found.
  double error = 0.0;  ///< Standard deviation of the shift per axis [m]: twice what is left of the distances tells, since the
                       ///< nearest points are nearer than the right ones.
  bool is_known() const noexcept { return found >= 0.6; }
};

/// Number of points in sight below which they say nothing, where others are out of it.
inline constexpr int few_in_sight = 5;

/// Trimmed nearest-neighbour registration: from `start` on, in each of up to `iterations` steps, the shift moves on by the mean offset
/// to the nearest points of the earlier set; what is 2.5 times farther than the median does not count. A sequence of steps that
/// shrinks geometrically, as on smooth surfaces, is summed up. No iterations: what `start` is worth. Points whose place then was out of
/// `sight` do not count.
Registration register_points(const Eigen::Matrix3Xd& points, const PointGrid& earlier, const Eigen::Vector3d& start,
                             int iterations, const Sight& sight = {});

/// A shift that a registration may start from.
struct Start {
  Eigen::Vector3d shift;  ///< [m]
  bool goes_on = false;   ///< of what moved before
};

/// The same from the best of several starts, no shift among them: rest goes first, since it needs no motion to explain what is seen.
/// A motion that goes on needs to explain more than rest, too, but not by as much.
Registration register_points(const Eigen::Matrix3Xd& points, const PointGrid& earlier, const std::vector<Start>& starts,
                             int iterations, const Sight& sight = {});

}  // namespace sidestep
