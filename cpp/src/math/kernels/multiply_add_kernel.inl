// Included by one file per instruction set, after multiply_add_kernel.hpp and intrinsics.hpp. Defines
// multiply_add in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "simd.inl"

// Independent chains: as many as two units with a latency of four or five cycles take, and registers hold.
constexpr int chains = 12;

int multiply_add(long rounds, double& result) noexcept {
  Lanes sums[chains];
  for (int i = 0; i < chains; ++i) {
    sums[i] = all(1.0 + i);
  }
  const Lanes factor = all(0.999), term = all(1e-3);
  for (long round = 0; round < rounds; ++round) {
#pragma GCC unroll 12
    for (int i = 0; i < chains; ++i) {
      sums[i] = sums[i] * factor + term;
    }
  }
  Lanes sum = sums[0];
  for (int i = 1; i < chains; ++i) {
    sum += sums[i];
  }
  result = sum[0];
  return 2 * chains * width;
}

}  // namespace
}  // namespace sidestep::kernels
