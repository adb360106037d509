// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "kinematics_kernel.hpp"

#include <immintrin.h>

#include "kinematics_block_kernel.inl"

namespace sidestep::kernels {

void update_link_block_avx2(const JointModel* joints, int num, const double* q, const double* v, double* links) noexcept {
  update_link_block(joints, num, q, v, links);
}

}  // namespace sidestep::kernels
#endif
