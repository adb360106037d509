#pragma once

namespace sidestep {

/// Where a frame b is in a frame a, and how it moves there. Plain arrays, for the kernels.
struct RelativeMotion {
  double rotation[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  // R_AB, by columns
  double position[3] = {};                                             // Origin p_AB [m].
  double angular[3] = {}, linear[3] = {};                              // Spatial velocity at the origin of a.
  double bias_angular[3] = {}, bias_linear[3] = {};                    // Its time derivative at q̈ = 0.
};

/// Pairs of an ellipsoid of a and one of b, side by side, and the gaps between them (see ellipsoid_gap.hpp). Symmetric
/// matrices are stored as xx, xy, xz, yy, yz, zz.
struct EllipsoidPairs {
  static constexpr int capacity = 64;  // Most pairs.

  RelativeMotion motion;
  int size = 0;
  alignas(64) double centre_a[3][capacity], centre_b[3][capacity];  // Centres, each in its frame [m].
  alignas(64) double shape_a[6][capacity], shape_b[6][capacity];    // S, each in its frame [m²]

  // In a.
  alignas(64) double value[capacity], rate[capacity], curvature[capacity];  // Gaps h, h', h'' at q̈ = 0.
  alignas(64) double normal[3][capacity];                                   // Normals n.
  alignas(64) double contact[3][capacity];                                  // Points of b nearest to a [m].
};

/// Ellipsoids of one link side by side, in its frame. What lies beyond `size` is finite.
struct EllipsoidColumns {
  static constexpr int capacity = 16;  // Most ellipsoids.

  int size = 0;
  alignas(64) double centre[3][capacity] = {}, shape[6][capacity] = {};  // Centres [m] and shapes S [m²].
};

}  // namespace sidestep
