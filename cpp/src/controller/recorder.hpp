#pragma once

#include <Eigen/Core>
#include <atomic>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "impl.hpp"
#include "record_ring.hpp"
#include "record_sink.hpp"

namespace sidestep {

/// Takes what the steps of a controller are given, take over and command, and writes it to a file or a black box from a thread of its
/// own, see recording.hpp.
///
/// Requests and obstacles are written once, by the thread that sets them, with the number by which a step takes them; the step
/// writes that number. What it takes over from workers is in Controller::Impl::Taken; a black box, which cannot be replayed, has none
/// of that.
class Recorder {
 public:
  /// `arm`: the newest, for a `whole` recording that before any change. `setters`: held by whoever sets something, until `note` knows
  /// it. Throws std::system_error where nothing can be written.
  Recorder(std::unique_ptr<RecordSink> sink, bool whole, const Controller::Impl& arm, std::mutex& setters);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // With `setters` held.
  /// What was set last, unless it is known already.
  void note(const Controller::Impl& newest);
  /// An arm that a step may take over from now on, with the one that follows once what rests is lifted.
  void add_arm(const Controller::Impl& arm, const std::vector<Controller::Held>& held);
  /// Nothing that is set from now on is recorded.
  void close() noexcept { closed_ = true; }
  /// Removes the files at the end where no step was made.
  void forget_if_empty() noexcept { keeps_empty_ = false; }

  /// What was recorded in the end.
  struct Ended {
    std::uint64_t steps = 0, lost = 0, bytes = 0;
    int error = 0;  // errno of the first failure
    std::vector<std::filesystem::path> files;
  };
  /// Without `setters`, after `close`, for one thread, when no step uses it any more.
  Ended finish();

  // Of the step.
  void begin_step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                  const Eigen::Ref<const Eigen::VectorXd>* bias, double time) noexcept;
  /// After the step of this arm.
  void end_step(Controller::Impl& arm) noexcept;

 private:
  void write_taken(recording::Encoder<RecordRing>& out, Controller::Impl& arm) noexcept;
  void run() noexcept;
  void write_what_there_is();
  void fail(int error) noexcept;
  template <class Record>
  void add(recording::RecordKind kind, const Record& record);
  void add(const RecordedSet& set);

  const bool whole_;
  std::mutex& setters_;  // Guards what follows.
  std::uint64_t noted_request_ = 0, noted_world_ = 0;
  bool keeps_empty_ = true, closed_ = false;
  struct Requested {
    recording::RecordKind kind;
    std::vector<std::byte> content;
    RecordedSet set;  // in place of the content of obstacles: the writer's thread makes it
  };
  void add(Requested requested, std::size_t size);
  /// Whether what is set is still recorded; where nothing is written any more, what waits is freed.
  bool takes_more();
  std::vector<Requested> requested_;  // records that the step did not make
  std::size_t requested_bytes_ = 0;

  // Of the step.
  RecordRing ring_;
  const bool synchronous_;
  bool full_ = false;
  std::atomic<std::uint64_t> made_{0};  // steps
  std::atomic<bool> failed_{false};     // nothing is written any more

  // Of the writer's thread, and after its end.
  std::unique_ptr<RecordSink> sink_;
  int error_ = 0;
  std::uint64_t steps_ = 0;
  double time_ = 0.0;  // of the last step [s]
  std::vector<std::byte> record_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sidestep
