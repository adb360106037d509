#pragma once

// Sums of outer products, once per instruction set. Plain arrays only, see kinematics_kernel.hpp.
namespace sidestep::kernels {

/// Numbers that are read beyond the last column, without effect.
inline constexpr int gram_room = 8;

/// Adds Σ_a c_a c_aᵀ to the lower triangle of a matrix, columns `stride` apart, for `num` columns c_a of `rows`
/// numbers, one after another.
using AddGram = void (*)(const double* columns, int num, int rows, double* matrix, int stride) noexcept;

void add_gram_baseline(const double* columns, int num, int rows, double* matrix, int stride) noexcept;
void add_gram_avx2(const double* columns, int num, int rows, double* matrix, int stride) noexcept;
void add_gram_avx512(const double* columns, int num, int rows, double* matrix, int stride) noexcept;

}  // namespace sidestep::kernels
