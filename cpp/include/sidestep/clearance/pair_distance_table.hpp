#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

namespace sidestep {

/// The clearance of two links that only two joints move relative to each other, as a function of these.
///
/// A uniform cubic B-spline in either coordinate, h(x, y) = Σ_ij B_i(x) B_j(y) c_ij, so twice continuously
/// differentiable. Beyond its ends it and its derivatives stay as they are there.
struct PairDistanceTable {
  /// Where the control points are: the one of number i at begin + i·spacing.
  struct Axis {
    int coordinate = 0;     ///< Coordinate of the robot.
    double begin = 0.0;     ///< Control point number 0 [rad | m].
    double spacing = 1.0;   ///< Distance of neighbouring control points [rad | m].
    bool periodic = false;  ///< Whether the first follows the last: they span one turn.
  };
  /// h [m] with its first and second derivatives by the two coordinates.
  struct Sample {
    double value;
    Eigen::Vector2d gradient;
    Eigen::Matrix2d hessian;
  };

  std::string first, second;  ///< Names of the links.
  std::array<Axis, 2> axes;
  Eigen::MatrixXd control;  ///< Control values c, at least 4 × 4 [m].

  Sample at(double x, double y) const noexcept;

  /// The steepest that the spline can be in either coordinate [m/rad | 1]: its derivatives are means of slopes between
  /// neighbouring control points.
  Eigen::Vector2d steepest() const noexcept;

  /// Of the control points [m]: what is usual.
  double median() const;

  /// Throws std::invalid_argument that names what is wrong, in a robot of `coordinates` coordinates.
  void validate(int coordinates) const;
};

}  // namespace sidestep
