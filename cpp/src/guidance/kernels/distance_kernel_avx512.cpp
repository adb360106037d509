// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "distance_kernel.hpp"

#include <immintrin.h>

#include "distance_kernel.inl"

namespace sidestep::kernels {

unsigned distances_avx512(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                      float* distances) noexcept {
  return distances_to(ellipsoid, balls, first, count, limit, distances);
}

}  // namespace sidestep::kernels
#endif
