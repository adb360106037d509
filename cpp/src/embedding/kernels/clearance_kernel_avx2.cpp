// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "clearance_kernel.hpp"

#include <immintrin.h>

#include "clearance_kernel.inl"

namespace sidestep::kernels {

bool add_leaf_avx2(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept {
  return add_leaf(group, points, leaf);
}

}  // namespace sidestep::kernels
#endif
