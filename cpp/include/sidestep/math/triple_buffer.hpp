#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>

namespace sidestep {

/// Hands the newest value to one reader that never waits, allocates or frees. Values in between are lost.
///
/// Writers in any number of threads `put` values and wait only for each other. Or a single writer fills `draft()` in place,
/// calls `submit()` and never waits. One of the three slots is being written, one is being read, one lies in between.
template <class T>
class TripleBuffer {
 public:
  explicit TripleBuffer(const T& initial) : slots_{initial, initial, initial} {}

  /// Replaces the value that the next `get` returns.
  void put(T value) {
    const std::lock_guard lock(writers_);
    draft() = std::move(value);
    submit();
  }

  /// Value that `submit` hands over; until it is filled, it holds an older one.
  T& draft() noexcept { return slots_[draft_]; }
  void submit() noexcept { draft_ = between_.exchange(static_cast<std::uint8_t>(draft_ | fresh)) & index; }

  /// Whether there is a value that `get` has not returned yet.
  bool is_fresh() const noexcept { return (between_.load(std::memory_order_relaxed) & fresh) != 0; }

  /// Takes over the newest value. Returns whether `get` had not returned it yet.
  bool update() noexcept {
    if ((between_.load(std::memory_order_relaxed) & fresh) == 0) {
      return false;
    }
    current_ = between_.exchange(current_) & index;
    return true;
  }

  /// Value of the reader, which may change it; takes over no newer one.
  T& current() noexcept { return slots_[current_]; }
  const T& current() const noexcept { return slots_[current_]; }

  /// The newest value; valid until the next call.
  const T& get() noexcept {
    update();
    return slots_[current_];
  }

 private:
  static constexpr std::uint8_t fresh = 4, index = 3;  // Bits of `between_`: a value that was not taken yet; index of the slot.
  std::array<T, 3> slots_;
  std::uint8_t draft_ = 0, current_ = 1;
  std::atomic<std::uint8_t> between_{2};
  std::mutex writers_;
};

}  // namespace sidestep
