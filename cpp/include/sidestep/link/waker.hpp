#pragma once

#include <atomic>

#include "sidestep/link/descriptor.hpp"

namespace sidestep::link {

/// Wakes a thread that waits at descriptors. Any thread may wake; nothing is allocated and nobody waits.
class Waker {
 public:
  /// Throws std::system_error where the system has no pipe left.
  Waker();
  void wake() noexcept;
  /// By the thread that was woken, before it looks at what there is to do.
  void calm() noexcept;
  /// Can be read while somebody has woken.
  int descriptor() const noexcept { return read_.number(); }

 private:
  Descriptor read_, write_;
  std::atomic<bool> woken_{false};
};

}  // namespace sidestep::link
