#include "sidestep/embedding/instruction_set.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

std::atomic<InstructionSet>& current() noexcept {
  static std::atomic<InstructionSet> set = instruction_sets().back();
  return set;
}

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
  std::vector<InstructionSet> sets{InstructionSet::baseline};
#if defined(SIDESTEP_X86_KERNELS)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    sets.push_back(InstructionSet::avx2);
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
      sets.push_back(InstructionSet::avx512);
    }
  }
#endif
  return sets;
}

InstructionSet instruction_set() noexcept { return current().load(std::memory_order_relaxed); }

void use(InstructionSet set) {
  const std::vector<InstructionSet> sets = instruction_sets();
  if (std::find(sets.begin(), sets.end(), set) == sets.end()) {
    std::string known;
    for (const InstructionSet other : sets) {
      known += (known.empty() ? "" : ", ") + std::string(name(other));
    }
    throw std::invalid_argument(std::string("instruction set ") + name(set) + " is not available; available are: " + known);
  }
  current() = set;
}

}  // namespace sidestep
