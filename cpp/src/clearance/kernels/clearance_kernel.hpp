#pragma once

#include "../../math/kernels/most_lanes.hpp"
#include "sidestep/scene/balls.hpp"

// The inner loop of ClearanceField, once per instruction set. Plain arrays only: a translation unit compiled for a
// newer instruction set must not emit code that others share, such as Eigen's inline functions.
namespace sidestep::kernels {

/// Points as structure of arrays, padded to whole leaves of `most_points`. `velocity[0]` is null where all are at rest.
struct Points {
  const double* position[3];
  const double* radius;
  double common_radius;  // of all points; negative where they differ
  const double* velocity[3];
  Balls leaf_balls;  // hold the balls of a leaf's points
  Boxes leaf_boxes;  // hold the points themselves, around the same centres, with their largest radius
};

/// How a link moves: spatial velocity and bias at the world origin, in the world (see kinematic_state.hpp).
struct LinkMotion {
  double rotation[9];  // R_WL, by columns
  double angular[3], linear[3], bias_angular[3], bias_linear[3];
  double turning;    // |angular|
  float to_link[9];  // R_LW, by rows
};

// Of the Boltzmann mean: w, w h', w h'' and w h'²; the same with w (h − reference) in place of w; ∂h and its twists
// (see Samples) with either. From `approach` on, of the mean of what approaches: w, w h, w h', w h'', and w ∂h and its
// twists.
inline constexpr int approach = 20, sums = 30;

inline constexpr int most_points = 16;       // Most points of a leaf.
inline constexpr int most_candidates = 512;  // Most candidate points of an ellipsoid.

/// Points that may weigh in the means of an ellipsoid, with what single precision says of them.
struct Candidates {
  int size;
  int point[most_candidates];
  float t[most_candidates];         // where Newton's iteration begins
  float least[2][most_candidates];  // h and h + τ h' from below
};

/// An ellipsoid at a state, with the sums of its means over the points so far, lane by lane.
struct Query {
  alignas(64) double lane_sums[sums][most_lanes];
  double axes[9];                          // world to principal axes, by rows
  double squared_axes[3], precision[3];    // a² and 1/a²
  double linear[3], angular[3];            // velocity of the centre and of the axes, in principal axes
  double bias_linear[3], bias_angular[3];  // the same for the bias
  double reference;                        // smallest clearance; sums are relative to it
  double ahead;                            // smallest h + τ h'
  int nearest, minded;                     // their points
  int shortest;                            // the axis of the smallest a
  bool near, approached;                   // whether a point may be within reach, or come to be
  bool begun;                              // whether what sums need has been set
  bool stale;                              // whether sums hold points beyond the windows above what is smallest by now
  Candidates candidates;
};

inline constexpr int most_queries = 16;  // Most ellipsoids of a group.

// Of every ellipsoid: link frame to principal axes by rows (9), squared semi-axes (3), semi-axes (3), and the smallest
// radius of curvature of its surface.
inline constexpr int squared_at = 9, semi_at = 12, roundness_at = 15, principal_numbers = 16;

inline constexpr int most_leaves = 64;  // Most leaves of a group.
// Distance between columns of points in memory: no multiple of 4 KiB, where loads wait for stores to other columns.
inline constexpr int points_apart = most_leaves * most_points + 5 * most_points;

/// Leaves that may matter to ellipsoids of a group, in single precision, seen from its origin.
struct Leaves {
  int num = 0;
  int leaf[most_leaves], count[most_leaves];                                              // which, and their numbers of points
  alignas(64) float centre[3][most_leaves], half[3][most_leaves], diagonal[most_leaves];  // boxes around the points
  float largest[most_leaves];                                                             // radius of a point
  float error[most_leaves];                                                               // of distances to its points [m]
  float velocity[3][most_leaves], speed[most_leaves];  // of the link's point at the centre [m/s]
  float more[most_leaves];                             // of others against theirs
  unsigned long long loaded;                           // leaves of which the points below are set, as bits
  alignas(64) float position[3][points_apart], radius[points_apart];
  float own[3][points_apart];  // velocity, where points move
};

inline constexpr int most_loose = 256;  // Most points of wide leaves.

/// Points of leaves so wide that all of one says little of a point, in single precision, seen from the origin of a
/// group.
struct LoosePoints {
  int num = 0;
  int point[most_loose];
  alignas(64) float position[3][most_loose], radius[most_loose];
  float own[3][most_loose];  // velocity, where points move
};

/// Ellipsoids of one link that are asked together.
struct QueryGroup {
  int size;
  double origin[3], centre[3][most_queries];  // world
  alignas(64) float offset[3][most_queries];  // from the origin
  alignas(64) float extent[most_queries];     // longest semi-axis
  // Clearances from here on do not matter, unless h + τ h' is below that: of the smallest known yet, and a window.
  // Until one within reach is known, points of leaves that are within reach are kept up to a window beyond, and of
  // other leaves it is noted what is missed.
  alignas(64) float near[most_queries], ahead[most_queries];
  alignas(64) float near_leaf[most_queries], ahead_leaf[most_queries];
  alignas(64) float missed[most_queries], missed_ahead[most_queries];
  const double* axes_T[most_queries];     // 3 × 3 by columns: link frame to principal axes
  const double* semi_axes[most_queries];  // [m]
  const LinkMotion* link;
  const float* principal;                   // see above; most_queries of each number
  float velocity[3];                        // of the link's point at the origin
  alignas(64) float axes[9][most_queries];  // world to principal axes, by rows
  float own_offset[3][most_queries], own_linear[3][most_queries], own_angular[3][most_queries];  // in principal axes
  double inverse_T;
  double reach, reach_ahead;  // clearances, and h + τ h', from here on are out of reach [m]
  // clearances, and h + τ h', so much above the smallest have no weight [m]
  double window, window_ahead;
  double horizon;  // τ [s]
  double fastest;  // speed of any point [m/s], at most
  Leaves leaves;
  LoosePoints loose;
  Query queries[most_queries];
};

/// A ball around ellipsoids of a link.
struct MovingBall {
  double centre[3];
  float radius;
  float velocity[3], angular[3];  // of the link's point at the centre
  float turning;                  // |angular|
  float horizon, fastest;         // as above
};

/// Clearances below the first matter, and where h + τ h' is below the second.
struct Limits {
  float near, ahead;
};

/// Leaves are looked at in single precision, for every query that their points matter to; what may weigh is summed in
/// double precision.
struct ClearanceKernel {
  /// Nodes [first, first + count) that are below limits, as bits: in the lower half of the word below `beyond`, in the
  /// upper half below `within`. Writes bounds of clearances, and has room for whole registers.
  unsigned (*measure)(const MovingBall& cluster, const Balls& balls, const Boxes& boxes, int first, int count,
                      const Limits& within, const Limits& beyond, float* bounds) noexcept;
  /// The same of `count` points from `first` on.
  unsigned (*measure_points)(const MovingBall& cluster, const Points& points, int first, int count, const Limits& within,
                             const Limits& beyond) noexcept;
  /// To be called once a group is placed.
  void (*begin)(QueryGroup& group) noexcept;
  /// Adds points of the group's leaves, and its loose points, that may weigh to the candidates, and lowers its limits.
  /// Where there is no room, the candidates before are summed.
  void (*collect)(QueryGroup& group, const Points& points) noexcept;
  /// Adds the candidates of query k to its sums, and forgets them.
  void (*sum)(QueryGroup& group, int k, const Points& points) noexcept;
};

ClearanceKernel clearance_kernel_baseline() noexcept;
ClearanceKernel clearance_kernel_avx2() noexcept;
ClearanceKernel clearance_kernel_avx512() noexcept;

}  // namespace sidestep::kernels
