#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdio>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "impl.hpp"
#include "recording_content.hpp"
#include "sidestep/controller/recording.hpp"

namespace sidestep {

/// Bytes on their way from one thread to another, in records that are handed over whole. The writing side allocates nothing.
class RecordRing {
 public:
  /// capacity: a power of two [B]. waits: for room, where there is none; else a record without room is dropped.
  RecordRing(std::size_t capacity, bool waits) : bytes_(capacity), waits_(waits) {}

  // Of the writing side.
  void begin() noexcept {
    cursor_ = head_.load(std::memory_order_relaxed) + sizeof(std::uint64_t);
    dropped_ = false;
  }
  void write(const void* data, std::size_t size) noexcept;
  /// Hands the record over; false where it was dropped.
  bool end() noexcept;

  // Of the reading side.
  /// Where nothing is read any more.
  void close() noexcept { waits_.store(false); }
  /// Up to where records have been handed over.
  std::uint64_t head() const noexcept { return head_.load(std::memory_order_acquire); }
  /// Moves the next record before `end` into `record`; false where there is none.
  bool take(std::vector<std::byte>& record, std::uint64_t end);

 private:
  bool has_room(std::uint64_t end) noexcept;
  void copy_in(std::uint64_t at, const void* data, std::size_t size) noexcept;
  void copy_out(std::uint64_t at, void* data, std::size_t size) const noexcept;

  std::vector<std::byte> bytes_;
  std::atomic<bool> waits_;
  bool dropped_ = false;
  std::uint64_t cursor_ = 0;
  std::atomic<std::uint64_t> head_{0}, tail_{0};
};

/// Writes what the steps of a controller are given, take over and command to a file, see recording.hpp.
///
/// Requests and obstacles are written once, by the thread that sets them, with the number by which a step takes them; the step
/// writes that number. What it takes over from workers is in Controller::Impl::Taken.
class Recorder {
 public:
  /// `first`: the arm before any change. `setters`: held by whoever sets something, until `note` knows it. Throws
  /// std::runtime_error where the arm has made a step, std::system_error where the file cannot be written.
  Recorder(const std::filesystem::path& path, const Controller::Impl& first, std::mutex& setters);
  ~Recorder() { finish_quietly(); }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // With `setters` held.
  /// What was set last, unless it is known already.
  void note(const Controller::Impl& newest);
  /// An arm that a step may take over from now on, with the one that follows once what rests is lifted.
  void add_arm(const Controller::Impl& arm, const std::vector<Controller::Held>& held);
  /// Nothing that is set from now on is recorded.
  void close() noexcept { closed_ = true; }
  /// Removes the file at the end where no step was made.
  void forget_if_empty() noexcept { keeps_empty_ = false; }

  /// Without `setters`, after `close`, for one thread. Throws std::system_error where something could not be written.
  RecordingSummary finish();

  // Of the step.
  void begin_step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                  const Eigen::Ref<const Eigen::VectorXd>* bias, double time) noexcept;
  /// After the step of this arm.
  void end_step(Controller::Impl& arm) noexcept;

 private:
  void run() noexcept;
  void write_what_there_is();
  void write(std::span<const std::byte> bytes);
  template <class Record>
  void add(std::string_view tag, const Record& record);
  void finish_quietly() noexcept;

  const std::filesystem::path path_;
  std::mutex& setters_;  // Guards what follows.
  std::uint64_t noted_request_ = 0, noted_world_ = 0;
  bool keeps_empty_ = true, closed_ = false;
  struct Requested {
    std::string_view tag;
    std::vector<std::byte> content;
  };
  std::vector<Requested> requested_;  // chunks that the step did not make

  // Of the step.
  RecordRing ring_;
  const bool synchronous_;
  std::uint64_t step_ = 0;
  bool full_ = false;
  std::atomic<std::uint64_t> lost_{0};

  // Of the writer's thread, and after its end.
  std::FILE* file_ = nullptr;
  int error_ = 0;  // errno of the first failure
  std::uint64_t steps_ = 0, written_ = 0;
  std::vector<std::byte> record_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sidestep
