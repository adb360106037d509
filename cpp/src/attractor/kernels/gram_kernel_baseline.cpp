// For every processor of the architecture.
#include "gram_kernel.hpp"

#include "../../math/kernels/intrinsics.hpp"

#include "gram_kernel.inl"

namespace sidestep::kernels {

void add_gram_baseline(const double* columns, int num, int rows, double* matrix, int stride) noexcept {
  add_gram(columns, num, rows, matrix, stride);
}

}  // namespace sidestep::kernels
