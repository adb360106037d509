#pragma once

#include "sidestep/scene/balls.hpp"

// The inner loop of ClearanceQuery and DistanceField, once per instruction set. Plain arrays only, as in the kernels of
// ClearanceField.
namespace sidestep::kernels {

/// An ellipsoid in the world.
struct PlacedEllipsoid {
  double centre[3];
  double axes[9];     // world to principal axes, by rows
  double squares[3];  // of the semi-axes [m²], ascending
  double extent;      // the longest [m]; 0: a point
};

inline constexpr int most_balls = 16;  // Most balls of one call; the arrays extend for as many from `first`.

/// Write lower bounds of the signed distances from the ellipsoid to the balls, or boxes, [first, first + count) into
/// `distances` (most_balls); bit i of the result: that of first + i is below `limit`. Those that are not may be coarse.
/// In single precision, relative to the centre: right to about a millionth of the distance. Those of balls are
/// distances but for what two steps of Newton leave; those of boxes are bounds.
struct Distances {
  unsigned (*of_balls)(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                       float* distances) noexcept;
  unsigned (*of_boxes)(const PlacedEllipsoid& ellipsoid, const Boxes& boxes, int first, int count, double limit,
                       float* distances) noexcept;

  unsigned operator()(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                      float* distances) const noexcept {
    return of_balls(ellipsoid, balls, first, count, limit, distances);
  }
  unsigned operator()(const PlacedEllipsoid& ellipsoid, const Boxes& boxes, int first, int count, double limit,
                      float* distances) const noexcept {
    return of_boxes(ellipsoid, boxes, first, count, limit, distances);
  }
};

Distances distances_baseline() noexcept;
Distances distances_avx2() noexcept;
Distances distances_avx512() noexcept;

/// The best for the machine.
Distances distances() noexcept;

}  // namespace sidestep::kernels
