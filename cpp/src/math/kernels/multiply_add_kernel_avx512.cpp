// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "multiply_add_kernel.hpp"

#include <immintrin.h>

#include "multiply_add_kernel.inl"

namespace sidestep::kernels {

int multiply_add_avx512(long rounds, double& result) noexcept { return multiply_add(rounds, result); }

}  // namespace sidestep::kernels
#endif
