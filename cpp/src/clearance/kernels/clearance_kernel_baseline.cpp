// For every processor of the architecture.
#include "clearance_kernel.hpp"

#include "../../math/kernels/intrinsics.hpp"

#include "clearance_kernel.inl"

namespace sidestep::kernels {

ClearanceKernel clearance_kernel_baseline() noexcept { return {measure, measure_points, begin, collect, sum_candidates}; }

}  // namespace sidestep::kernels
