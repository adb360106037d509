#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace sidestep {

/// Hands the newest value from one thread to another; neither ever waits. Values in between are lost.
///
/// One thread fills `back()` and publishes it, one other takes the newest with `update()` and reads `front()`. The three
/// slots stay where they are, so that nothing is allocated or freed by handing over.
template <typename T>
class TripleBuffer {
 public:
  explicit TripleBuffer(const T& initial) : slots_{initial, initial, initial} {}

  T& back() noexcept { return slots_[back_]; }
  void publish() noexcept { back_ = between_.exchange(static_cast<std::uint8_t>(back_ | fresh)) & index; }

  /// Whether there is a newer value; `front()` is it then.
  bool update() noexcept {
    if ((between_.load(std::memory_order_relaxed) & fresh) == 0) {
      return false;
    }
    front_ = between_.exchange(front_) & index;
    return true;
  }
  const T& front() const noexcept { return slots_[front_]; }

 private:
  static constexpr std::uint8_t fresh = 4, index = 3;
  std::array<T, 3> slots_;
  std::uint8_t back_ = 0, front_ = 1;
  std::atomic<std::uint8_t> between_{2};
};

}  // namespace sidestep
