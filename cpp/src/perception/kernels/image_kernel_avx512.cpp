// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "image_kernel.hpp"

#include "image_kernel.inl"

namespace sidestep::kernels {

ImageKernel image_kernel_avx512() noexcept { return image_kernel; }

}  // namespace sidestep::kernels
#endif
