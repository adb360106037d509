#include "real_time_thread.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#endif

namespace sidestep {
namespace {

constexpr std::size_t touched_stack = std::size_t{256} << 10;  // Stack that is there before the first cycle [B].

/// Has the pages of the stack mapped, so that no cycle waits for one.
void touch_stack() noexcept {
  volatile char stack[touched_stack];
  for (std::size_t k = 0; k < touched_stack; k += 4096) {
    stack[k] = 0;
  }
  static_cast<void>(stack[0]);
}

}  // namespace

std::string RealTimeGrant::words() const {
  return (prioritised ? "SCHED_FIFO " + std::to_string(priority) : std::string("no real-time scheduling")) +
         (locked ? ", memory locked" : ", memory not locked");
}

bool lock_memory() noexcept {
#if defined(__linux__) && defined(MCL_ONFAULT)
  return mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
#else
  return false;
#endif
}

RealTimeGrant ask_for_real_time([[maybe_unused]] int priority) noexcept {
  RealTimeGrant grant;
#ifdef __linux__
  if (priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = std::clamp(priority, sched_get_priority_min(SCHED_FIFO), sched_get_priority_max(SCHED_FIFO));
    grant.prioritised = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
    grant.priority = parameters.sched_priority;
  }
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);  // wakes when it asked for, not up to 50 µs later to save power
#endif
  touch_stack();
  return grant;
}

double monotonic_time() noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void sleep_until(double time) noexcept {
  using Clock = std::chrono::steady_clock;
  std::this_thread::sleep_until(
      Clock::time_point(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time))));
}

}  // namespace sidestep
