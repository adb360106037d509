// For every processor of the architecture, see CMakeLists.txt.
#include "image_kernel.hpp"

#include "image_kernel.inl"

namespace sidestep::kernels {

ImageKernel image_kernel_baseline() noexcept { return image_kernel; }

}  // namespace sidestep::kernels
