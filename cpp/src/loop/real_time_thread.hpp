#pragma once

#include <string>

namespace sidestep {

/// What a thread got of what it asked the machine for.
struct RealTimeGrant {
  bool prioritised = false, locked = false;
  int priority = 0;

  std::string words() const;
};

/// Asks for memory of this program that is never swapped out; whether that is permitted. Takes long where much memory is in use.
bool lock_memory() noexcept;
/// Asks for real-time scheduling of this thread at a priority from 1 to 99 (0: not asked), and for wake-ups without slack.
RealTimeGrant ask_for_real_time(int priority) noexcept;

/// Machine's monotonic clock [s].
double monotonic_time() noexcept;
/// Sleeps until then.
void sleep_until(double time) noexcept;

}  // namespace sidestep
