// For every processor of the architecture, see CMakeLists.txt.
#include "multiply_add_kernel.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "multiply_add_kernel.inl"

namespace sidestep::kernels {

int multiply_add_baseline(long rounds, double& result) noexcept { return multiply_add(rounds, result); }

}  // namespace sidestep::kernels
