#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "sidestep/loop/supervisor_rules.hpp"

namespace sidestep {

/// A value that one process writes and another reads, without locks: a slot is written while others can be read.
template <class Value>
class SharedSlots {
 public:
  void write(const Value& value) noexcept {
    const std::uint32_t next = number_.load(std::memory_order_relaxed) + 1;
    Slot& slot = slots_[next % slots_.size()];
    slot.number.store(0, std::memory_order_release);
    std::atomic_thread_fence(std::memory_order_release);
    slot.value = value;
    slot.number.store(next, std::memory_order_release);
    number_.store(next, std::memory_order_release);
  }
  /// The newest value; false: none was written.
  bool read(Value& value) const noexcept {
    while (true) {
      const std::uint32_t number = number_.load(std::memory_order_acquire);
      if (number == 0) {
        return false;
      }
      const Slot& slot = slots_[number % slots_.size()];
      if (slot.number.load(std::memory_order_acquire) == number) {
        value = slot.value;
        std::atomic_thread_fence(std::memory_order_acquire);
        if (slot.number.load(std::memory_order_relaxed) == number) {
          return true;
        }
      }
    }
  }
  /// Number of values written so far; another process can wait for it to change.
  std::atomic<std::uint32_t>& number() noexcept { return number_; }

 private:
  struct Slot {
    std::atomic<std::uint32_t> number{0};
    Value value{};
  };
  std::atomic<std::uint32_t> number_{0};
  std::array<Slot, 4> slots_;
};

/// What loop and supervisor share.
struct SupervisedMemory {
  static constexpr std::uint64_t magic = 0x5353'5550'0000'0001;  // "SSUP", version 1

  std::uint64_t kind = magic, size = sizeof(SupervisedMemory);
  std::int32_t loop_process = 0, joints = 0;
  double period = 0.0;
  SupervisorSettings settings;
  CycleReport::Numbers lower{}, upper{}, velocity{}, effort{}, effort_rate{};
  std::atomic<std::uint32_t> resets{0};
  SharedSlots<CycleReport> reports;
  SharedSlots<Verdict> verdicts;
};

/// Waits until `number` is not `seen` any more, at most so long [s].
void wait_for_change(std::atomic<std::uint32_t>& number, std::uint32_t seen, double timeout) noexcept;
/// Wakes who waits for it.
void wake(std::atomic<std::uint32_t>& number) noexcept;

}  // namespace sidestep
