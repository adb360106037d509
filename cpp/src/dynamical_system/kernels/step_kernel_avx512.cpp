// Compiled for AVX-512, see CMakeLists.txt; empty for other processors.
#if defined(__AVX512F__)
#include "step_kernel.hpp"

#include <immintrin.h>

#include "step_kernel.inl"

namespace sidestep::kernels {

unsigned take_steps_avx512(const StepModel& model, const StepRows& rows) noexcept { return take_steps(model, rows); }

}  // namespace sidestep::kernels
#endif
