#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

// How the benchmarks time: every call on its own, against the monotonic clock.
namespace sidestep::benchmarks {

struct Timing {
  double median, p95, p99, p999, max;  ///< [ns] per call
  double throughput;                   ///< calls per second, without the clock between calls
};

/// Times `call(k)` for k = 0 … num − 1, after a tenth as many calls to warm up. Each sample is the mean of `batch`
/// calls, so that reading the clock (20 to 30 ns) weighs little; a batch of 1 shows every single call.
template <typename Call>
Timing time_calls(Call&& call, std::size_t num, std::size_t batch) {
  using Clock = std::chrono::steady_clock;
  const auto nanoseconds = [](Clock::duration d) { return std::chrono::duration<double, std::nano>(d).count(); };
  for (std::size_t k = 0; k < num / 10; ++k) {
    call(k);
  }
  std::vector<double> samples(num / batch);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto start = Clock::now();
    for (std::size_t k = i * batch; k < (i + 1) * batch; ++k) {
      call(k);
    }
    samples[i] = nanoseconds(Clock::now() - start) / static_cast<double>(batch);
  }
  const auto start = Clock::now();
  for (std::size_t k = 0; k < num; ++k) {
    call(k);
  }
  const double total = nanoseconds(Clock::now() - start);
  std::sort(samples.begin(), samples.end());
  const auto quantile = [&](double p) {
    return samples[std::min(samples.size() - 1, static_cast<std::size_t>(p * static_cast<double>(samples.size())))];
  };
  return {quantile(0.5),   quantile(0.95), quantile(0.99),
          quantile(0.999), samples.back(), 1e9 * static_cast<double>(num) / total};
}

/// Model name of the processor, from the kernel; "unknown" where it does not say.
inline std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) {
      return line.substr(line.find(':') + 2);
    }
  }
  return "unknown";
}

}  // namespace sidestep::benchmarks
