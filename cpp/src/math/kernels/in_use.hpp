#pragma once

#include "sidestep/math/instruction_set.hpp"

namespace sidestep::kernels {

/// That of the instruction set in use.
template <class Kernel>
Kernel in_use(Kernel baseline, Kernel avx2, Kernel avx512) noexcept {
  switch (instruction_set()) {
    case InstructionSet::avx512: return avx512;
    case InstructionSet::avx2: return avx2;
    case InstructionSet::baseline: break;
  }
  return baseline;
}

}  // namespace sidestep::kernels

/// The function of that name, which there is once per instruction set, for the one in use. Other processors have one.
#if defined(SIDESTEP_X86_KERNELS)
#define SIDESTEP_KERNEL_IN_USE(name) ::sidestep::kernels::in_use(&name##_baseline, &name##_avx2, &name##_avx512)
#else
#define SIDESTEP_KERNEL_IN_USE(name) (&name##_baseline)
#endif
