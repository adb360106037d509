#include "record_ring.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

namespace sidestep {
namespace {

constexpr std::chrono::microseconds wait_for_room{50};  // Time between two looks of a synchronous step for space.

}  // namespace

bool RecordRing::has_room(std::uint64_t end) noexcept {
  if (end - head_.load(std::memory_order_relaxed) > bytes_.size()) {
    return false;  // one record alone is too large
  }
  while (end - tail_.load(std::memory_order_acquire) > bytes_.size()) {
    if (!waits_.load(std::memory_order_relaxed)) {
      return false;
    }
    std::this_thread::sleep_for(wait_for_room);
  }
  return true;
}

void RecordRing::copy_in(std::uint64_t at, const void* data, std::size_t size) noexcept {
  const std::size_t begin = at & (bytes_.size() - 1), first = std::min(size, bytes_.size() - begin);
  std::memcpy(bytes_.data() + begin, data, first);
  std::memcpy(bytes_.data(), static_cast<const std::byte*>(data) + first, size - first);
}

void RecordRing::copy_out(std::uint64_t at, void* data, std::size_t size) const noexcept {
  const std::size_t begin = at & (bytes_.size() - 1), first = std::min(size, bytes_.size() - begin);
  std::memcpy(data, bytes_.data() + begin, first);
  std::memcpy(static_cast<std::byte*>(data) + first, bytes_.data(), size - first);
}

void RecordRing::write(const void* data, std::size_t size) noexcept {
  if (size == 0) {
    return;
  }
  dropped_ = dropped_ || !has_room(cursor_ + size);
  if (!dropped_) {
    copy_in(cursor_, data, size);
    cursor_ += size;
  }
}

bool RecordRing::end(double time) noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  if (dropped_) {
    return false;
  }
  const Frame frame{cursor_ - begin_, time};
  copy_in(head, &frame, sizeof frame);
  head_.store(cursor_, std::memory_order_release);
  return true;
}

bool RecordRing::take(std::vector<std::byte>& record, double& time, std::uint64_t end) {
  const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  if (tail == end) {
    return false;
  }
  Frame frame;
  copy_out(tail, &frame, sizeof frame);
  record.resize(static_cast<std::size_t>(frame.size));
  time = frame.time;
  copy_out(tail + sizeof frame, record.data(), record.size());
  tail_.store(tail + sizeof frame + frame.size, std::memory_order_release);
  return true;
}

}  // namespace sidestep
