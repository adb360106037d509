// For every processor of the architecture.
#include "gap_kernel.hpp"

#include "../../math/kernels/intrinsics.hpp"

#include "gap_kernel.inl"

namespace sidestep::kernels {

GapKernel gap_kernel_baseline() noexcept { return {find_gaps, bound_gaps}; }

}  // namespace sidestep::kernels
