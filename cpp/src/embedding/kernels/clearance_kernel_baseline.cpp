// For every processor of the architecture.
#include "clearance_kernel.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "clearance_kernel.inl"

namespace sidestep::kernels {

bool add_leaf_baseline(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept {
  return add_leaf(group, points, leaf);
}

}  // namespace sidestep::kernels
