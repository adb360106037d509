#pragma once

#include <vector>

namespace sidestep {

/// What the inner loops over points are compiled for.
enum class InstructionSet {
  baseline,  ///< every processor of the architecture
  avx2,      ///< x86-64 with AVX2 and FMA
  avx512,    ///< x86-64 with AVX-512 F, DQ and VL
};

/// "baseline", "avx2" or "avx512".
const char* name(InstructionSet set) noexcept;

/// Those that this build holds and this machine runs, best last.
std::vector<InstructionSet> instruction_sets();

/// The one in use: the best, unless told otherwise.
InstructionSet instruction_set() noexcept;

/// Uses another one, for tests and benchmarks; not while a loop runs. Throws std::invalid_argument if this machine or
/// build lacks it.
void use(InstructionSet set);

}  // namespace sidestep
