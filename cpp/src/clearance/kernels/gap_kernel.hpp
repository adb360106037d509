#pragma once

#include "sidestep/clearance/ellipsoid_pairs.hpp"

// Newton's method of EllipsoidGaps and the bounds of EllipsoidRow, once per instruction set. Plain arrays only, as in
// clearance_kernel.hpp.
namespace sidestep::kernels {

struct GapKernel {
  /// Writes what the gaps of all pairs are. What lies between `size` and the next full register is overwritten.
  void (*find)(EllipsoidPairs& pairs) noexcept;
  /// Writes lower bounds of the gaps to an ellipsoid of b, with `centre` in a and S `shape` in b, and room for whole
  /// registers.
  void (*bound)(const EllipsoidColumns& a, const double* rotation, const double* centre, const double* shape,
                double* bounds) noexcept;
};

GapKernel gap_kernel_baseline() noexcept;
GapKernel gap_kernel_avx2() noexcept;
GapKernel gap_kernel_avx512() noexcept;

}  // namespace sidestep::kernels
