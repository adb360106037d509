// For every processor of the architecture.
#include "density_kernel.hpp"

#include "../../math/kernels/intrinsics.hpp"

#include "density_kernel.inl"

namespace sidestep::kernels {

void add_density_baseline(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                          DensitySums& sums) noexcept {
  add_density(gaussians, links, points, sums);
}

}  // namespace sidestep::kernels
