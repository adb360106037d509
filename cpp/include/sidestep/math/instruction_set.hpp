#pragma once

#include <vector>

namespace sidestep {

/// Instruction set of the inner loops over points.
enum class InstructionSet {
  baseline,  ///< Every processor of the architecture.
  avx2,      ///< Processors x86-64 with AVX2 and FMA.
  avx512,    ///< Processors x86-64 with AVX-512 F, DQ and VL.
};

/// "baseline", "avx2" or "avx512".
const char* name(InstructionSet set) noexcept;

/// Instruction sets that this build contains and this machine runs, best last.
std::vector<InstructionSet> instruction_sets();

/// Instruction set in use: the best, unless `use` chose another.
InstructionSet instruction_set() noexcept;

/// Chooses an instruction set, for tests and benchmarks; not while a loop runs. Throws std::invalid_argument if this machine
/// or build lacks it.
void use(InstructionSet set);

}  // namespace sidestep
