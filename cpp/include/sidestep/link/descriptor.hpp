#pragma once

#include <span>
#include <utility>

namespace sidestep::link {

/// A file descriptor that is closed at the end.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() { close(); }

  int number() const noexcept { return number_; }
  explicit operator bool() const noexcept { return number_ >= 0; }
  void close() noexcept;

 private:
  int number_ = -1;
};

/// Whether one of two descriptors can be read within `timeout` [s]; the second, -1 for none, wakes a waiting thread.
bool wait_readable(int descriptor, double timeout, int waker = -1) noexcept;
/// The same of any of several, at most 16.
bool wait_readable(std::span<const int> descriptors, double timeout) noexcept;

}  // namespace sidestep::link
