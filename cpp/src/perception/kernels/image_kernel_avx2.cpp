// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "image_kernel.hpp"

#include "image_kernel.inl"

namespace sidestep::kernels {

ImageKernel image_kernel_avx2() noexcept { return image_kernel; }

}  // namespace sidestep::kernels
#endif
