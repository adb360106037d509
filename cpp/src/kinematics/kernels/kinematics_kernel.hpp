#pragma once

#include "link_numbers.hpp"

// The loop over joints of KinematicState, once per instruction set. Plain arrays only: a translation unit compiled for
// a newer instruction set must not emit code that others share, such as Eigen's inline functions.
namespace sidestep::kernels {

/// What of a joint does not change, as columns of four numbers of which the last is 0: see kinematic_state.hpp.
struct JointModel {
  double fixed[3][4], cosine[3][4], sine[3][4];  // the rotation is fixed + cos θ · cosine + sin θ · sine
  double translation[4], axis[4];                // in the parent's frame
  double multiplier;                             // of the coordinate
  int parent;                                    // -1: the base
  bool slides;                                   // a prismatic joint, with sine and cosine 0
};

/// Joints at a time whose sines and cosines are taken together.
inline constexpr int joint_block = 4;

/// Writes the links of joints [0, num), `stride` doubles apart. The arrays of joints go on to whole blocks.
using UpdateLinks = void (*)(const JointModel* joints, int num, const double* positions, const double* velocities,
                             double* links, int stride) noexcept;

void update_links_baseline(const JointModel* joints, int num, const double* positions, const double* velocities,
                           double* links, int stride) noexcept;
void update_links_avx2(const JointModel* joints, int num, const double* positions, const double* velocities,
                       double* links, int stride) noexcept;

}  // namespace sidestep::kernels
