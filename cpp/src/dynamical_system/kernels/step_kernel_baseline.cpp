// For every processor of the architecture.
#include "step_kernel.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "step_kernel.inl"

namespace sidestep::kernels {

unsigned take_steps_baseline(const StepModel& model, const StepRows& rows) noexcept { return take_steps(model, rows); }

}  // namespace sidestep::kernels
