// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "multiply_add_kernel.hpp"

#include <immintrin.h>

#include "multiply_add_kernel.inl"

namespace sidestep::kernels {

int multiply_add_avx2(long rounds, double& result) noexcept { return multiply_add(rounds, result); }

}  // namespace sidestep::kernels
#endif
