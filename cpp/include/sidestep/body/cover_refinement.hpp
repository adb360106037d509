#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// Signed distances to a surface at the nodes of a grid [m], positive outside; trilinear in between.
struct DistanceGrid {
  Eigen::Vector3d origin;      ///< Position of node (0, 0, 0) [m].
  double spacing;              ///< Distance between neighbouring nodes [m].
  std::array<int, 3> shape;    ///< Numbers of nodes, each >= 2.
  std::vector<double> values;  ///< Distances; node (i, j, k) is at (i shape[1] + j) shape[2] + k.

  /// The distance at a point and its gradient; a point off the grid sees the grid's border.
  double operator()(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const noexcept;
};

/// Solid ellipsoids {centre + shape u : |u| <= 1} [m].
struct SolidEllipsoids {
  std::vector<Eigen::Vector3d> centres;
  std::vector<Eigen::Matrix3d> shapes;

  int size() const noexcept { return static_cast<int>(centres.size()); }
};

/// How `refine_cover` descends.
struct CoverRefinement {
  int steps;             ///< Steps of the descent (Adam).
  double first_rate;     ///< Length of the first steps [m].
  double last_rate;      ///< Length of the last steps [m]; geometric in between.
  double stiffness;      ///< Stiffness of the augmented Lagrangian, per squared depth in `unit`.
  int multiplier_steps;  ///< Steps between two updates of the multipliers.
  double margin;         ///< Depth by which points should lie inside [m].
  double unit;           ///< Overshoot at which its mean and its peaks count alike [m].
  double area;           ///< Area of the surface [m^2]: overshoot is counted per area.
  double slimness;       ///< Least ratio of shortest to longest semi-axis [-].
};

/// Moves and bends ellipsoids so that their union holds points of a surface and overshoots the surface little.
///
/// Minimises  sum over the union's boundary of (area / settings.area) (o + o^2 + o^6),  o = distance outside / unit,
/// subject to  g_i = min_k (|y_i - c_k| - r_k(y_i)) <= -margin  for every point y_i, where r_k(y) is the distance from
/// the centre c_k to the ellipsoid's boundary in the direction of y. Method: augmented Lagrangian with Adam, whose
/// steps have one length per ellipsoid, so that the descent does not depend on the frame.
///
/// points (3 × N) [m]; directions: sets of unit vectors, used in turn, at which the boundary is felt; multipliers (N,)
/// of the points, updated. The proof of the cover is made elsewhere: nothing here is a guarantee. Throws Interruption
/// if interrupted, which is asked before every step; ellipsoids and multipliers are then those of the step before.
void refine_cover(const DistanceGrid& grid, const Eigen::Matrix3Xd& points, const std::vector<Eigen::Matrix3Xd>& directions,
                  const CoverRefinement& settings, SolidEllipsoids& ellipsoids, Eigen::VectorXd& multipliers,
                  const Interrupted& interrupted = never_interrupted);

}  // namespace sidestep
