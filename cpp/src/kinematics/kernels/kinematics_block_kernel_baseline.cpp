// For every processor of the architecture.
#include "kinematics_kernel.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "kinematics_block_kernel.inl"

namespace sidestep::kernels {

void update_link_block_baseline(const JointModel* joints, int num, const double* q, const double* v, double* links) noexcept {
  update_link_block(joints, num, q, v, links);
}

}  // namespace sidestep::kernels
