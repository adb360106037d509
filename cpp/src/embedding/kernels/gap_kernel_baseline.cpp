// For every processor of the architecture.
#include "gap_kernel.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "gap_kernel.inl"

namespace sidestep::kernels {

void find_gaps_baseline(EllipsoidPairs& pairs) noexcept {
  find_gaps(pairs);
}

}  // namespace sidestep::kernels
