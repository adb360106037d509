// A waker: no wake-up is lost, however its two threads meet.
#include "sidestep/link/waker.hpp"

#include <atomic>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <thread>

#include "sidestep/link/descriptor.hpp"

using namespace sidestep::link;

BOOST_AUTO_TEST_CASE(what_was_written_before_a_wake_is_seen_after_calm) {
  constexpr int rounds = 30'000;
  constexpr double patience = 1.0;  // [s] far beyond what a busy machine keeps a thread waiting
  Waker waker;
  std::atomic<int> written{0}, seen{0};
  std::atomic<bool> lost{false};
  std::thread reader([&] {
    while (seen.load(std::memory_order_relaxed) < 2 * rounds && !lost) {
      const bool woken = wait_readable(waker.descriptor(), patience);
      if (!woken && written.load() != seen.load() && !wait_readable(waker.descriptor(), patience)) {
        lost = true;
      }
      waker.calm();
      seen.store(written.load(std::memory_order_relaxed));
    }
  });
  const auto write = [&](int value) {
    written.store(value, std::memory_order_relaxed);
    waker.wake();
  };
  for (int k = 1; k <= rounds && !lost; ++k) {
    write(2 * k - 1);
    // The second wake meets the reader where it is calm, calms the waker, or has done so.
    const auto until = std::chrono::steady_clock::now() + std::chrono::nanoseconds(100 * (k * 37 % 400));
    while (std::chrono::steady_clock::now() < until) {
    }
    write(2 * k);
    while (seen.load() != 2 * k && !lost) {
      std::this_thread::yield();
    }
  }
  reader.join();
  BOOST_TEST(!lost);
  BOOST_TEST(seen == 2 * rounds);
}
