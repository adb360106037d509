#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>

namespace sidestep {

/// Hands the newest value to one reader that never waits, allocates or frees. Values in between are lost.
///
/// Writers either `put` values, from any number of threads, which wait for each other alone; or one of them fills
/// `draft()` in place and calls `submit()`, and waits for nobody. Of the three slots one is written, one read and one
/// between the two; what the reader has done with is overwritten by a writer.
template <class T>
class TripleBuffer {
 public:
  explicit TripleBuffer(const T& initial) : slots_{initial, initial, initial} {}

  /// Replaces what `get` gives from its next call on.
  void put(T value) {
    const std::lock_guard lock(writers_);
    draft() = std::move(value);
    submit();
  }

  /// What `submit` hands over; it holds some older value.
  T& draft() noexcept { return slots_[draft_]; }
  void submit() noexcept { draft_ = between_.exchange(static_cast<std::uint8_t>(draft_ | fresh)) & index; }

  /// Whether there is a value that `get` has not given yet.
  bool is_fresh() const noexcept { return (between_.load(std::memory_order_relaxed) & fresh) != 0; }

  /// Takes over the newest value, and says whether there is one that `get` has not given yet.
  bool update() noexcept {
    if ((between_.load(std::memory_order_relaxed) & fresh) == 0) {
      return false;
    }
    current_ = between_.exchange(current_) & index;
    return true;
  }

  /// What the reader has, without taking over a newer one; its to change.
  T& current() noexcept { return slots_[current_]; }
  const T& current() const noexcept { return slots_[current_]; }

  /// The newest value; valid until the next call.
  const T& get() noexcept {
    update();
    return slots_[current_];
  }

 private:
  static constexpr std::uint8_t fresh = 4, index = 3;
  std::array<T, 3> slots_;
  std::uint8_t draft_ = 0, current_ = 1;
  std::atomic<std::uint8_t> between_{2};
  std::mutex writers_;
};

}  // namespace sidestep
