// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "clearance_kernel.hpp"

#include <immintrin.h>

#include "clearance_kernel.inl"

namespace sidestep::kernels {

ClearanceKernel clearance_kernel_avx512() noexcept { return {measure, measure_points, begin, collect, sum_candidates}; }

}  // namespace sidestep::kernels
#endif
