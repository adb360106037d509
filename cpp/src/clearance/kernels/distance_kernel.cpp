#include "distance_kernel.hpp"

#include "../../math/kernels/in_use.hpp"

namespace sidestep::kernels {

Distances distances() noexcept { return SIDESTEP_KERNEL_IN_USE(distances)(); }

}  // namespace sidestep::kernels
