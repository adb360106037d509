#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace sidestep {

/// Bytes on their way from one thread to another, in records that are handed over whole, each with its time. The writing side
/// allocates nothing.
class RecordRing {
 public:
  /// capacity: a power of two [B]. waits: for room, where there is none; else a record without room is dropped.
  RecordRing(std::size_t capacity, bool waits) : bytes_(capacity), waits_(waits) {}

  // Of the writing side.
  void begin() noexcept {
    begin_ = cursor_ = head_.load(std::memory_order_relaxed) + sizeof(Frame);
    dropped_ = false;
  }
  void write(const void* data, std::size_t size) noexcept;
  /// Bytes of the record so far.
  std::size_t written() const noexcept { return static_cast<std::size_t>(cursor_ - begin_); }
  /// Hands the record over; false where it was dropped.
  bool end(double time) noexcept;

  // Of the reading side.
  /// Where nothing is read any more.
  void close() noexcept { waits_.store(false); }
  /// Up to where records have been handed over.
  std::uint64_t head() const noexcept { return head_.load(std::memory_order_acquire); }
  /// Moves the next record before `end` into `record`; false where there is none.
  bool take(std::vector<std::byte>& record, double& time, std::uint64_t end);

 private:
  /// What stands before a record.
  struct Frame {
    std::uint64_t size;
    double time;
  };
  bool has_room(std::uint64_t end) noexcept;
  void copy_in(std::uint64_t at, const void* data, std::size_t size) noexcept;
  void copy_out(std::uint64_t at, void* data, std::size_t size) const noexcept;

  std::vector<std::byte> bytes_;
  std::atomic<bool> waits_;
  bool dropped_ = false;
  std::uint64_t begin_ = 0, cursor_ = 0;
  std::atomic<std::uint64_t> head_{0}, tail_{0};
};

}  // namespace sidestep
