#pragma once

#include <Eigen/Core>
#include <vector>

namespace sidestep {

/// Distance [m] of a point to a triangle, by its corners; a triangle without area is its edges.
double triangle_distance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) noexcept;

/// The smallest distance (N) [m] of points (3 × N) [m] to those triangles that are candidates of each.
///
/// corners (3 × 3F) [m]: three columns for each triangle; candidates: C numbers of triangles for each point, in order. Throws
/// std::invalid_argument where they are not a multiple of N or name no triangle.
Eigen::VectorXd nearest_triangle_distances(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& corners,
                                           const std::vector<int>& candidates);

}  // namespace sidestep
