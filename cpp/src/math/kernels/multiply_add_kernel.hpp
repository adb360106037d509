#pragma once

// Multiplications and additions in registers alone, once per instruction set: what a processor does at most.
namespace sidestep::kernels {

/// Does `rounds` rounds and returns the operations of one, a multiplication and an addition being two. What is computed
/// goes to `result`, so that it has to be.
int multiply_add_baseline(long rounds, double& result) noexcept;
int multiply_add_avx2(long rounds, double& result) noexcept;
int multiply_add_avx512(long rounds, double& result) noexcept;

}  // namespace sidestep::kernels
