#pragma once

#include "sidestep/obstacles/balls.hpp"

// The inner loop of BodyClearance, once per instruction set. Plain arrays only, as in the kernels of ClearanceField.
namespace sidestep::kernels {

/// An ellipsoid in the world.
struct PlacedEllipsoid {
  double centre[3];
  double axes[9];     // world to principal axes, by rows
  double squares[3];  // of the semi-axes [m²], ascending
  double extent;      // the longest [m]; 0: a point
};

inline constexpr int most_balls = 16;  // of one call; the arrays go on for so many from `first`

/// Writes lower bounds of the signed distances from the ellipsoid to the balls [first, first + count) into `distances`
/// (most_balls); bit i of the result: that of ball first + i is below `limit`. Those that are not may be coarse.
/// In single precision, relative to the centre: right to about a millionth of the distance.
using Distances = unsigned (*)(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                               float* distances) noexcept;

unsigned distances_baseline(const PlacedEllipsoid&, const Balls&, int, int, double, float*) noexcept;
unsigned distances_avx2(const PlacedEllipsoid&, const Balls&, int, int, double, float*) noexcept;
unsigned distances_avx512(const PlacedEllipsoid&, const Balls&, int, int, double, float*) noexcept;

/// The best for the machine.
Distances distances() noexcept;

}  // namespace sidestep::kernels
