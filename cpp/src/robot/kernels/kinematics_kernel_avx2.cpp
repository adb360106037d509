// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "kinematics_kernel.hpp"

#include "kinematics_kernel.inl"

namespace sidestep::kernels {

void update_links_avx2(const JointModel* joints, int num, const double* q, const double* v, double* links,
                       int stride) noexcept {
  update_links(joints, num, q, v, links, stride);
}

}  // namespace sidestep::kernels
#endif
