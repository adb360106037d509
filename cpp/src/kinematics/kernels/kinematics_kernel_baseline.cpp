// For every processor of the architecture.
#include "kinematics_kernel.hpp"

#include "kinematics_kernel.inl"

namespace sidestep::kernels {

void update_links_baseline(const JointModel* joints, int num, const double* positions, const double* velocities,
                           double* links, int stride) noexcept {
  update_links(joints, num, positions, velocities, links, stride);
}

}  // namespace sidestep::kernels
