// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "gap_kernel.hpp"

#include <immintrin.h>

#include "gap_kernel.inl"

namespace sidestep::kernels {

void find_gaps_avx512(EllipsoidPairs& pairs) noexcept {
  find_gaps(pairs);
}

}  // namespace sidestep::kernels
#endif
