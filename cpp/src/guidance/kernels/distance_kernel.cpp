#include "distance_kernel.hpp"

#include "sidestep/kinematics/instruction_set.hpp"

namespace sidestep::kernels {

Distances distances() noexcept {
#if defined(SIDESTEP_X86_KERNELS)
  switch (instruction_set()) {
    case InstructionSet::avx512: return distances_avx512();
    case InstructionSet::avx2: return distances_avx2();
    case InstructionSet::baseline: break;
  }
#endif
  return distances_baseline();
}

}  // namespace sidestep::kernels
