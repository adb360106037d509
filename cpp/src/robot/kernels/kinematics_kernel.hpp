#pragma once

#include "link_numbers.hpp"
#include "../../math/kernels/most_lanes.hpp"

// The loop over joints of KinematicState, once per instruction set. Plain arrays only: a translation unit compiled for
// a newer instruction set must not emit code that others share, such as Eigen's inline functions.
namespace sidestep::kernels {

/// What of a joint does not change, as columns of four numbers of which the last is 0: see kinematic_state.hpp.
struct JointModel {
  double x[4], y[4], axis[4];  // in the parent's frame; the joint turns x to y, about its axis
  double translation[4];       // in the parent's frame
  double child[3][4];          // the child's frame in (x, y, axis), once these have turned
  double multiplier, offset;   // of the coordinate
  int coordinate;
  int parent;     // -1: the base
  bool slides;    // a prismatic joint: along its axis
  bool straight;  // (x, y, axis) is the child's frame
};

/// Joints whose sines and cosines are computed together.
inline constexpr int joint_block = 4;

/// Writes the links of joints [0, num), `stride` doubles apart, at q and v. The joints go on to whole blocks.
using UpdateLinks = void (*)(const JointModel* joints, int num, const double* q, const double* v, double* links,
                             int stride) noexcept;

void update_links_baseline(const JointModel* joints, int num, const double* q, const double* v, double* links,
                           int stride) noexcept;
void update_links_avx2(const JointModel* joints, int num, const double* q, const double* v, double* links, int stride) noexcept;

}  // namespace sidestep::kernels
