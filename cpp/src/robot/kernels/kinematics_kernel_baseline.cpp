// For every processor of the architecture.
#include "kinematics_kernel.hpp"

#include "kinematics_kernel.inl"

namespace sidestep::kernels {

void update_links_baseline(const JointModel* joints, int num, const double* q, const double* v, double* links,
                           int stride) noexcept {
  update_links(joints, num, q, v, links, stride);
}

}  // namespace sidestep::kernels
