#include "sidestep/math/multiply_add_rate.hpp"

#include <algorithm>
#include <chrono>

#include "settings.hpp"
#include "kernels/in_use.hpp"
#include "kernels/multiply_add_kernel.hpp"

namespace sidestep {
namespace {

constexpr long rounds = 10'000;  // Rounds of one measurement: some hundred microseconds.

int multiply_add(double& result) noexcept { return SIDESTEP_KERNEL_IN_USE(kernels::multiply_add)(rounds, result); }

}  // namespace

double multiply_add_rate(double duration) {
  require_positive(duration, "duration");
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> whole(duration);
  const auto begin = Clock::now();
  double most = 0.0;
  volatile double used = 0.0;
  for (auto now = begin; now - begin < whole;) {
    const auto before = now;
    double result;
    const int operations = multiply_add(result);
    used = result;
    now = Clock::now();
    most = std::max(most, operations * static_cast<double>(rounds) / std::chrono::duration<double>(now - before).count());
  }
  static_cast<void>(used);
  return most;
}

}  // namespace sidestep
