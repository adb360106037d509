#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "posix.hpp"

namespace sidestep::link {

using PollClock = std::chrono::steady_clock;

/// When a timeout [s] ends.
inline PollClock::time_point deadline_in(double timeout) noexcept {
  constexpr double longest = 1e6;  // [s]; a longer one is as good as for ever
  return PollClock::now() + std::chrono::duration_cast<PollClock::duration>(
                                std::chrono::duration<double>(std::clamp(std::isnan(timeout) ? 0.0 : timeout, 0.0, longest)));
}
inline double time_left(PollClock::time_point deadline) noexcept {
  return std::max(0.0, std::chrono::duration<double>(deadline - PollClock::now()).count());
}

#ifdef SIDESTEP_POSIX
/// Number of descriptors that are ready within `timeout` [s]; signals do not end it.
int poll_for(std::span<pollfd> descriptors, double timeout) noexcept;
#endif

}  // namespace sidestep::link
