// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "gap_kernel.hpp"

#include <immintrin.h>

#include "gap_kernel.inl"

namespace sidestep::kernels {

GapKernel gap_kernel_avx512() noexcept { return {find_gaps, bound_gaps}; }

}  // namespace sidestep::kernels
#endif
