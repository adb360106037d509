#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "sidestep/link/report_messages.hpp"

namespace sidestep::link {

/// Cycles on their way from the loop's thread to the server's. Neither waits for the other; where the ring is full, a cycle is left out.
class CycleRing {
 public:
  CycleRing(int num_coordinates, std::size_t size) : slots_(size, CycleMessage(num_coordinates)) {}

  /// In the loop's thread; no allocation. False: it is full, or the vectors have another size.
  bool push(std::uint64_t cycle, const RobotState& state, const Command& command, double now) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    CycleMessage& slot = slots_[head % slots_.size()];
    if (head - tail_.load(std::memory_order_acquire) == slots_.size() || state.q.size() != slot.state.q.size() ||
        command.position.size() != slot.command.position.size()) {
      return false;
    }
    slot.cycle = cycle;
    slot.now = now;
    slot.state = state;
    slot.command = command;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// In the server's thread: the oldest cycle; null: there is none. It is the server's until `pop`.
  CycleMessage* front() noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    return tail == head_.load(std::memory_order_acquire) ? nullptr : &slots_[tail % slots_.size()];
  }
  void pop() noexcept { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

 private:
  std::vector<CycleMessage> slots_;
  std::atomic<std::size_t> head_{0}, tail_{0};
};

}  // namespace sidestep::link
