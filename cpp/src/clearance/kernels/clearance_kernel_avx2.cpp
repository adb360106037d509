// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "clearance_kernel.hpp"

#include <immintrin.h>

#include "clearance_kernel.inl"

namespace sidestep::kernels {

ClearanceKernel clearance_kernel_avx2() noexcept { return {measure, measure_points, begin, collect, sum_candidates}; }

}  // namespace sidestep::kernels
#endif
