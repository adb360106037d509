// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "gram_kernel.hpp"

#include <immintrin.h>

#include "gram_kernel.inl"

namespace sidestep::kernels {

void add_gram_avx2(const double* columns, int num, int rows, double* matrix, int stride) noexcept {
  add_gram(columns, num, rows, matrix, stride);
}

}  // namespace sidestep::kernels
#endif
