#pragma once

#include <deque>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "recording_file.hpp"

namespace sidestep {

/// The last seconds of a controller on disk: files of a third of them each, of which the oldest are deleted. Each begins with the arm,
/// the obstacles and the request that its first step uses.
class BlackBox final : public RecordSink {
 public:
  /// folder: is made if need be. seconds: kept, at most four thirds of them. most_bytes: of all black boxes in the folder, about. Throws
  /// std::invalid_argument, std::system_error.
  BlackBox(std::filesystem::path folder, const std::string& arm, int num_coordinates, double seconds, std::uint64_t most_bytes);

  void write(recording::RecordKind kind, double time, std::span<const std::byte> content) override;
  void write_set(double time, const RecordedSet& set) override;
  void flush() override;
  void close() override;
  int error() const noexcept override { return file_ ? file_->error() : 0; }
  std::vector<std::filesystem::path> files() const override { return {files_.begin(), files_.end()}; }
  std::uint64_t bytes() const noexcept override;

 private:
  using Content = std::vector<std::byte>;
  /// Points of a source, and when a step used them first [s].
  struct PointSet {
    RecordedSet set;
    double used = std::numeric_limits<double>::quiet_NaN();
  };

  /// Begins another file where this one is long enough.
  void make_room(bool for_step, double time);
  void keep(recording::RecordKind kind, std::span<const std::byte> content);
  /// Forgets what this step and those after it cannot use.
  void use(const recording::StepInputs& step, double time);
  void forget_unneeded_sets();
  /// When a step used a set first [s]; NaN: none did.
  double first_use(std::uint64_t set) const;
  void begin_file();
  void write_present();
  void delete_old();
  template <class Record>
  void write_record(recording::RecordKind kind, const Record& record);

  const std::filesystem::path folder_;
  const int num_coordinates_;
  const double seconds_;
  const std::uint64_t most_bytes_;
  std::string stem_;
  std::uint64_t count_ = 0;  // Number of files so far.
  std::deque<std::filesystem::path> files_;
  std::unique_ptr<RecordingFile> file_;
  bool has_steps_ = false;
  std::uint64_t present_bytes_ = 0;  // Size of what the file begins with.
  double begun_ = 0.0, time_ = 0.0;  // Time of the first step of the file, and of this record [s].
  recording::HeadRecord head_;
  // By number, in the order of setting: the one that the last step used, and those after it.
  std::map<std::uint64_t, Content> arms_, requests_;
  std::map<std::uint64_t, recording::WorldRecord> worlds_;
  std::map<std::uint64_t, PointSet> sets_;
  // Newest at the last flush: older ones no step takes any more.
  std::uint64_t settled_world_ = 0, settled_request_ = 0;
  recording::StepInputs step_;
};

}  // namespace sidestep
