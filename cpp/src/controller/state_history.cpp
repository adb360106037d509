#include "sidestep/controller/state_history.hpp"

#include <cmath>
#include <limits>

namespace sidestep {

// What a state holds is written after its version, with release, and read before the version is read again, with acquire: a reader
// that sees a part of a newer state sees the newer version too.

StateHistory::StateHistory(int num_coordinates)
    : nv_(static_cast<std::size_t>(num_coordinates)), slots_(capacity), positions_(capacity * nv_) {}

void StateHistory::put(double time, ConstVectorRef q) noexcept {
  const std::uint64_t number = end_.load(std::memory_order_relaxed);
  if (number > 0 && !(time > slots_[(number - 1) % capacity].time.load(std::memory_order_relaxed))) {
    first_.store(number, std::memory_order_relaxed);
  }
  Slot& slot = slots_[number % capacity];
  slot.version.store(2 * number + 1, std::memory_order_relaxed);
  slot.time.store(time, std::memory_order_release);
  for (std::size_t i = 0; i < nv_; ++i) {
    positions_[(number % capacity) * nv_ + i].store(q[static_cast<Eigen::Index>(i)], std::memory_order_release);
  }
  slot.version.store(2 * number + 2, std::memory_order_release);
  end_.store(number + 1, std::memory_order_release);
}

bool StateHistory::read_time(std::uint64_t number, double& time) const noexcept {
  const Slot& slot = slots_[number % capacity];
  const bool is_written = slot.version.load(std::memory_order_acquire) == 2 * number + 2;
  time = slot.time.load(std::memory_order_acquire);
  return is_written && slot.version.load(std::memory_order_relaxed) == 2 * number + 2;
}

bool StateHistory::read(std::uint64_t number, double& time, Eigen::Ref<Eigen::VectorXd> q) const noexcept {
  const Slot& slot = slots_[number % capacity];
  const bool is_written = slot.version.load(std::memory_order_acquire) == 2 * number + 2;
  time = slot.time.load(std::memory_order_acquire);
  for (std::size_t i = 0; i < nv_; ++i) {
    q[static_cast<Eigen::Index>(i)] = positions_[(number % capacity) * nv_ + i].load(std::memory_order_acquire);
  }
  return is_written && slot.version.load(std::memory_order_relaxed) == 2 * number + 2;
}

bool StateHistory::at(double time, Eigen::Ref<Eigen::VectorXd> q) const noexcept {
  const std::uint64_t end = end_.load(std::memory_order_acquire);
  const std::uint64_t first = first_.load(std::memory_order_relaxed);
  for (std::uint64_t number = end; number-- > first && end - number < capacity;) {
    double before = 0.0;
    if (!read_time(number, before)) {
      return false;
    }
    if (before > time) {
      continue;
    }
    Eigen::VectorXd earlier(q.size()), later(q.size());
    double after = before;
    if (!read(number, before, earlier)) {
      return false;
    }
    if (number + 1 == end || !read(number + 1, after, later)) {
      q = earlier;
      return true;
    }
    q = earlier + (time - before) / (after - before) * (later - earlier);
    return true;
  }
  return false;
}

double StateHistory::last_time() const noexcept {
  const std::uint64_t end = end_.load(std::memory_order_acquire);
  double time = 0.0;
  return end > 0 && read_time(end - 1, time) ? time : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace sidestep
