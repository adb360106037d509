// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "gap_kernel.hpp"

#include <immintrin.h>

#include "gap_kernel.inl"

namespace sidestep::kernels {

GapKernel gap_kernel_avx2() noexcept { return {find_gaps, bound_gaps}; }

}  // namespace sidestep::kernels
#endif
