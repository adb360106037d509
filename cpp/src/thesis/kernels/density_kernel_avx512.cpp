// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "density_kernel.hpp"

#include <immintrin.h>

#include "density_kernel.inl"

namespace sidestep::kernels {

void add_density_avx512(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                        DensitySums& sums) noexcept {
  add_density(gaussians, links, points, sums);
}

}  // namespace sidestep::kernels
#endif
