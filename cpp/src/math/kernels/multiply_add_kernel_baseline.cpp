// For every processor of the architecture, see CMakeLists.txt.
#include "multiply_add_kernel.hpp"

#include "intrinsics.hpp"

#include "multiply_add_kernel.inl"

namespace sidestep::kernels {

int multiply_add_baseline(long rounds, double& result) noexcept { return multiply_add(rounds, result); }

}  // namespace sidestep::kernels
