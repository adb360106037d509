// For every processor of the architecture.
#include "density_kernel.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "density_kernel.inl"

namespace sidestep::kernels {

void add_density_baseline(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                          DensitySums& sums) noexcept {
  add_density(gaussians, links, points, sums);
}

void add_density_block_baseline(const GaussianBlock* blocks, int num, const JointTree& joints, const double* links,
                                const DensityPoints& points, const DensityRows& rows) noexcept {
  add_density_block(blocks, num, joints, links, points, rows);
}

}  // namespace sidestep::kernels
