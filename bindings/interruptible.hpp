#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <optional>
#include <utility>

#include "sidestep/math/interruption.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep::python {

namespace nb = nanobind;

/// Lets Python handle its signals now and then, Ctrl-C among them, while the thread that called works without the GIL.
class SignalPoll {
 public:
  /// With the GIL. Python handles signals in its main thread alone: in others nothing is asked.
  SignalPoll();
  /// Whether a handler has raised. Without the GIL, which it takes every `pause` at most.
  bool operator()() noexcept;

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds pause{50};
  static constexpr std::chrono::milliseconds slow{1};  // Time between two checks of the clock above which every call checks it.
  static constexpr int most_calls = 16;                // Most calls between two checks, if they take less.

  bool is_main_, raised_ = false;
  int calls_ = 1, left_ = 1;
  Clock::time_point looked_ = Clock::now(), asked_ = looked_;
};

/// work(interrupted) without the GIL. Where a signal's handler raises, KeyboardInterrupt at Ctrl-C, that is raised and
/// the result dropped.
template <class Work>
auto interruptible(Work&& work) {
  SignalPoll poll;
  try {
    const nb::gil_scoped_release release;
    auto result = work(Interrupted([&poll] { return poll(); }));
    if (!poll()) {
      return result;
    }
  } catch (const Interruption&) {
  }
  throw nb::python_error();
}

/// Lets an object with `interrupt_when` be interrupted for a while.
template <class Object>
class InterruptedWhile {
 public:
  InterruptedWhile(Object* object, const Interrupted& interrupted) : object_(object) {
    if (object_ != nullptr) {
      object_->interrupt_when(interrupted);
    }
  }
  InterruptedWhile(const InterruptedWhile&) = delete;
  InterruptedWhile& operator=(const InterruptedWhile&) = delete;
  ~InterruptedWhile() {
    if (object_ != nullptr) {
      object_->interrupt_when(never_interrupted);
    }
  }

 private:
  Object* object_;
};

/// Holds an object for one call, while others may run without the GIL; raises RuntimeError if it is held. With the GIL.
class Exclusive {
 public:
  Exclusive(const void* object, const char* what);
  Exclusive(const Exclusive&) = delete;
  Exclusive& operator=(const Exclusive&) = delete;
  ~Exclusive();

 private:
  const void* object_;
};

/// Obstacles that no other thread moves meanwhile. Those at rest are not copied. Made with the GIL.
class HeldObstacles {
 public:
  explicit HeldObstacles(const Obstacles& obstacles) : obstacles_(obstacles) {
    if (obstacles.tree().moves()) {
      copy_ = obstacles;
    }
  }
  operator const Obstacles&() const noexcept { return copy_ ? *copy_ : obstacles_; }

 private:
  const Obstacles& obstacles_;
  std::optional<Obstacles> copy_;
};

}  // namespace sidestep::python
