// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "gap_kernel.hpp"

#include <immintrin.h>

#include "gap_kernel.inl"

namespace sidestep::kernels {

void find_gaps_avx2(EllipsoidPairs& pairs) noexcept {
  find_gaps(pairs);
}

}  // namespace sidestep::kernels
#endif
