#pragma once

#include <span>
#include <vector>

#include "polling.hpp"

namespace sidestep::link {

/// Waits at several descriptors at once.
class Poller {
 public:
#ifdef SIDESTEP_POSIX
  void clear() noexcept { waits_.clear(); }
  void add(int descriptor, bool writes) {
    waits_.push_back({descriptor, static_cast<short>(writes ? POLLIN | POLLOUT : POLLIN), 0});
  }
  void wait(double timeout) noexcept {
    if (poll_for(waits_, timeout) < 0) {
      for (pollfd& wait : waits_) {
        wait.revents = 0;
      }
    }
  }
  /// Whether there is something to read from the k-th, its end included.
  bool is_readable(std::size_t k) const noexcept { return (waits_[k].revents & (POLLIN | POLLHUP | POLLERR | POLLNVAL)) != 0; }

 private:
  std::vector<pollfd> waits_;
#else
  void clear() noexcept {}
  void add(int, bool) {}
  void wait(double) noexcept {}
  bool is_readable(std::size_t) const noexcept { return false; }
#endif
};

}  // namespace sidestep::link
