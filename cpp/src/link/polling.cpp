#include "polling.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "sidestep/link/descriptor.hpp"
#include "sidestep/link/waker.hpp"

namespace sidestep::link {

#ifdef SIDESTEP_POSIX

int poll_for(std::span<pollfd> descriptors, double timeout) noexcept {
  const auto deadline = deadline_in(timeout);
  for (;;) {
    const double left = time_left(deadline);
#ifdef __linux__
    const double whole = std::floor(left);
    const timespec wait{static_cast<time_t>(whole), static_cast<long>((left - whole) * 1e9)};
    const int ready = ::ppoll(descriptors.data(), static_cast<nfds_t>(descriptors.size()), &wait, nullptr);
#else
    const int ready =
        ::poll(descriptors.data(), static_cast<nfds_t>(descriptors.size()), static_cast<int>(std::ceil(left * 1e3)));
#endif
    if (ready >= 0 || errno != EINTR) {
      return ready;
    }
  }
}

void Descriptor::close() noexcept {
  if (number_ >= 0) {
    ::close(std::exchange(number_, -1));
  }
}

bool wait_readable(int descriptor, double timeout, int waker) noexcept {
  pollfd waits[] = {{descriptor, POLLIN, 0}, {waker, POLLIN, 0}};
  return poll_for(std::span(waits, waker < 0 ? 1u : 2u), timeout) > 0;
}

bool wait_readable(std::span<const int> descriptors, double timeout) noexcept {
  std::array<pollfd, 16> waits;
  const std::size_t count = std::min(descriptors.size(), waits.size());
  for (std::size_t k = 0; k < count; ++k) {
    waits[k] = {descriptors[k], POLLIN, 0};
  }
  return poll_for(std::span(waits).first(count), timeout) > 0;
}

Waker::Waker() {
  int ends[2];
  if (::pipe(ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "no pipe");
  }
  read_ = Descriptor(ends[0]);
  write_ = Descriptor(ends[1]);
  for (const int end : ends) {
    ::fcntl(end, F_SETFL, ::fcntl(end, F_GETFL) | O_NONBLOCK);
    ::fcntl(end, F_SETFD, FD_CLOEXEC);
  }
}

void Waker::wake() noexcept {
  if (!woken_.exchange(true, std::memory_order_seq_cst)) {
    const char byte = 0;
    [[maybe_unused]] const auto written = ::write(write_.number(), &byte, 1);  // a full pipe wakes as well
  }
}

void Waker::calm() noexcept {
  char bytes[16];
  while (::read(read_.number(), bytes, sizeof bytes) > 0) {
  }
  // An exchange, not a store: what was written before a `wake` that finds the flag still set is seen after this.
  woken_.exchange(false, std::memory_order_seq_cst);
}

#else

void Descriptor::close() noexcept {}
bool wait_readable(int, double, int) noexcept { return false; }
bool wait_readable(std::span<const int>, double) noexcept { return false; }
Waker::Waker() { throw std::runtime_error(no_sockets); }
void Waker::wake() noexcept {}
void Waker::calm() noexcept {}

#endif

}  // namespace sidestep::link
