#include "sidestep/math/instruction_set.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

InstructionSet best() noexcept {
#if defined(SIDESTEP_X86_KERNELS)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    const bool avx512 =
        __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    return avx512 ? InstructionSet::avx512 : InstructionSet::avx2;
  }
#endif
  return InstructionSet::baseline;
}

// Set when the program is loaded, so that the first step of a loop neither allocates nor takes a lock for it.
std::atomic<InstructionSet> current{best()};

}  // namespace

const char* name(InstructionSet set) noexcept {
  switch (set) {
    case InstructionSet::baseline: return "baseline";
    case InstructionSet::avx2: return "avx2";
    case InstructionSet::avx512: return "avx512";
  }
  return "unknown";
}

std::vector<InstructionSet> instruction_sets() {
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (set <= best()) {
      sets.push_back(set);
    }
  }
  return sets;
}

InstructionSet instruction_set() noexcept { return current.load(std::memory_order_relaxed); }

void use(InstructionSet set) {
  const std::vector<InstructionSet> sets = instruction_sets();
  if (std::find(sets.begin(), sets.end(), set) == sets.end()) {
    std::string known;
    for (const InstructionSet other : sets) {
      known += (known.empty() ? "" : ", ") + std::string(name(other));
    }
    throw std::invalid_argument(std::string("instruction set ") + name(set) + " is not available; available are: " + known);
  }
  current = set;
}

}  // namespace sidestep
