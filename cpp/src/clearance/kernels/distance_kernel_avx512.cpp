// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "distance_kernel.hpp"

#include <immintrin.h>

#include "distance_kernel.inl"

namespace sidestep::kernels {

Distances distances_avx512() noexcept { return {distances_to_balls, distances_to_boxes}; }

}  // namespace sidestep::kernels
#endif
