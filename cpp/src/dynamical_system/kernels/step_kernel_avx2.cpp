// Compiled for AVX2 and FMA, see CMakeLists.txt; empty for other processors.
#if defined(__AVX2__)
#include "step_kernel.hpp"

#include <immintrin.h>

#include "step_kernel.inl"

namespace sidestep::kernels {

unsigned take_steps_avx2(const StepModel& model, const StepRows& rows) noexcept { return take_steps(model, rows); }

}  // namespace sidestep::kernels
#endif
