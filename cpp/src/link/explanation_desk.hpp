#pragma once

#include <atomic>
#include <exception>
#include <string>

#include "sidestep/controller/controller.hpp"

namespace sidestep::link {

/// Has the loop's thread, which alone may, put into words what the controller does, and hands the words to the server's thread.
class ExplanationDesk {
 public:
  // Of the server's thread.
  void ask() noexcept {
    State idle = State::idle;
    state_.compare_exchange_strong(idle, State::asked, std::memory_order_acq_rel);
  }
  /// Whether there are words; they are then moved into `words`.
  bool take(std::string& words) {
    if (state_.load(std::memory_order_acquire) != State::answered) {
      return false;
    }
    words = std::move(words_);
    state_.store(State::idle, std::memory_order_release);
    return true;
  }

  /// In the loop's thread: answers where somebody asked, at most ten times a second. True: it has.
  bool answer(const Controller& controller, double now) noexcept {
    constexpr double pause = 0.1;  // Shortest time between two answers [s].
    if (state_.load(std::memory_order_acquire) != State::asked || now - answered_ < pause) {
      return false;
    }
    answered_ = now;
    try {
      words_ = controller.explain();
    } catch (const std::exception&) {  // no memory
      words_.clear();
    }
    state_.store(State::answered, std::memory_order_release);
    return true;
  }

 private:
  enum class State { idle, asked, answered };
  std::atomic<State> state_{State::idle};
  std::string words_;       // Of whoever the state says.
  double answered_ = -1e9;  // Of the loop's thread [s].
};

}  // namespace sidestep::link
