// For every processor of the architecture.
#include "distance_kernel.hpp"

#include "../../math/kernels/intrinsics.hpp"

#include "distance_kernel.inl"

namespace sidestep::kernels {

Distances distances_baseline() noexcept { return {distances_to_balls, distances_to_boxes}; }

}  // namespace sidestep::kernels
