#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace sidestep {

/// Finds out whether several threads step one controller, which has one thread's state. No lock, no allocation.
class SingleStepper {
 public:
  /// Begins a step. False where another thread is inside one: then this one must not touch the controller.
  bool enter() noexcept {
    if (inside_.exchange(true)) {
      return false;
    }
    const std::thread::id now = std::this_thread::get_id();
    const bool changed = last_ != std::thread::id() && now != last_;
    same_ = changed ? 0 : std::min(same_ + 1, settled + 1);
    if (changed) {
      changes_ = std::min(changes_ + 1, most_changes + 1);
    } else if (same_ > settled) {
      changes_ = 0;
    }
    last_ = now;
    in_turn_.store(changed && changes_ > most_changes, std::memory_order_relaxed);
    return true;
  }
  /// Ends the step of the thread that is inside.
  void leave() noexcept {
    turns_.store(turns_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    inside_.store(false, std::memory_order_release);
  }
  /// Waits, in another thread, until a step that is being made has ended: what was taken from the steps before is then unused.
  void wait_until_left() const noexcept {
    const std::uint64_t turn = turns_.load();
    while (inside_.load() && turns_.load() == turn) {
      std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
  }
  /// Whether the last step came from another thread than the one before, and that again and again: two loops that share a
  /// controller, each with a state of its own. Handing a loop over to another thread is none.
  bool in_turn() const noexcept { return in_turn_.load(std::memory_order_relaxed); }

 private:
  static constexpr int settled = 1000;    // steps of one thread after which earlier changes do not count
  static constexpr int most_changes = 2;  // Changes of the thread: to another one, and back.

  std::atomic<bool> inside_{false};
  std::atomic<std::uint64_t> turns_{0};  // steps so far
  std::thread::id last_;
  int changes_ = 0, same_ = 0;
  std::atomic<bool> in_turn_{false};
};

}  // namespace sidestep
