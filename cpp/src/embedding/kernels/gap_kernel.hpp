#pragma once

#include "sidestep/embedding/ellipsoid_pairs.hpp"

// Newton's method of EllipsoidGaps, once per instruction set. Plain arrays only, as in clearance_kernel.hpp.
namespace sidestep::kernels {

/// Writes what the gaps of all pairs are. What lies between `size` and the next full register is overwritten.
using FindGaps = void (*)(EllipsoidPairs& pairs) noexcept;

void find_gaps_baseline(EllipsoidPairs& pairs) noexcept;
void find_gaps_avx2(EllipsoidPairs& pairs) noexcept;
void find_gaps_avx512(EllipsoidPairs& pairs) noexcept;

}  // namespace sidestep::kernels
