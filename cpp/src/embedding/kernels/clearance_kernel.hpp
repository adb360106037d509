#pragma once

#include "most_lanes.hpp"

// The inner loop of ClearanceField, once per instruction set. Plain arrays only: a translation unit compiled for a newer
// instruction set must not emit code that others share, such as Eigen's inline functions.
namespace sidestep::kernels {

/// Points as structure of arrays, padded to whole registers. `velocity[0]` is null where all are at rest.
struct Points {
  const double* position[3];
  const double* radius;
  const double* velocity[3];
};

/// How a link moves: spatial velocity and bias at the world origin, in the world (see kinematic_state.hpp).
struct LinkMotion {
  double rotation[9];  // R_WL, by columns
  double angular[3], linear[3], bias_angular[3], bias_linear[3];
};

// Of the Boltzmann mean s0, ṡ0, s̈0, s1, ṡ1, s̈1 and two gradients of force and moment; from `approach` on, of the
// mean of what approaches: the weight, h, h', h'' and a gradient.
inline constexpr int approach = 18, sums = 28;

/// An ellipsoid at a state, with the sums of its means over the points so far, lane by lane.
struct Query {
  alignas(64) double lane_sums[sums][most_lanes];
  double axes[9];                           // world to principal axes, by rows
  double semi_axes[3], squared_axes[3];     // a and a²
  double linear[3], angular[3];             // velocity of the centre and of the axes, in principal axes
  double bias_linear[3], bias_angular[3];   // the same for the bias
  double reference;                         // smallest clearance; sums are relative to it
  double ahead;                             // smallest h + τ h'
  int nearest, minded;                      // their points
  int shortest;                             // the axis of the smallest a
  bool ready;                               // whether all but the centre has been set
};

inline constexpr int most_queries = 16;

/// Ellipsoids of one link that are asked together.
struct QueryGroup {
  int size;
  alignas(64) double centre[3][most_queries];  // world
  alignas(64) double extent[most_queries];     // longest semi-axis
  alignas(64) double near[most_queries];       // clearances from here on do not matter,
  alignas(64) double ahead[most_queries];      // unless h + τ h' is below this
  const double* axes_T[most_queries];          // 3 × 3 by columns: link frame to principal axes
  const double* semi_axes[most_queries];       // [m]
  const LinkMotion* link;
  double inverse_T;
  double window, window_ahead;                 // clearances, and h + τ h', so much above the smallest have no weight [m]
  double horizon;                              // τ [s]
  double fastest;                              // speed of any point [m/s], at most
  Query queries[most_queries];
};

/// The balls of a leaf's points lie within `radius` of (x, y, z); the points lie in a box with that centre, and have radii
/// of up to `largest`.
struct Leaf {
  int first, count;
  double x, y, z, radius;
  double half_x, half_y, half_z, largest;
};

/// What is done with the points of a leaf, for every query of the group that they matter to: what is smallest is found
/// first, so that only what weighs beside it is looked at when the sums are made.
struct ClearanceKernel {
  /// Lowers `reference` and `ahead` of the queries, `near` and `ahead` of the group to them. Returns whether any fell.
  bool (*find)(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept;
  /// Adds to the sums.
  void (*add)(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept;
};

ClearanceKernel clearance_kernel_baseline() noexcept;
ClearanceKernel clearance_kernel_avx2() noexcept;
ClearanceKernel clearance_kernel_avx512() noexcept;

}  // namespace sidestep::kernels
