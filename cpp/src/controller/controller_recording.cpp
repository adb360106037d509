// Recordings and black boxes of a controller.
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "black_box.hpp"
#include "impl.hpp"
#include "recorder.hpp"
#include "recording_file.hpp"

namespace sidestep {

void Controller::record(const std::filesystem::path& path) {
  const std::lock_guard lock(setters_);
  if (recorder_) {
    throw std::runtime_error("controller: it has been recorded already; make another controller for another recording");
  }
  if (impl_->num_steps() != 0) {
    throw std::runtime_error("controller: recording begins before the first step, but it has made " +
                             std::to_string(impl_->num_steps()) + "; make another controller");
  }
  recorder_ = std::make_unique<Recorder>(std::make_unique<RecordingFile>(path, num_coordinates()), true, *impl_, setters_);
  recorder_->note(newest());
  if (newest_ != impl_.get()) {
    recorder_->add_arm(*newest_, held_);
  }
  records_.store(recorder_.get());
}

RecordingSummary Controller::stop_recording() {
  {
    const std::lock_guard lock(setters_);
    if (records_.exchange(nullptr) == nullptr) {
      throw std::runtime_error("controller: nothing is recorded; begin with `record`");
    }
    recorder_->close();
  }
  stepper_.wait_until_left();
  const Recorder::Ended ended = recorder_->finish();
  const std::filesystem::path& path = ended.files.front();
  if (ended.error != 0) {
    throw std::system_error(ended.error, std::generic_category(), "cannot write recording '" + path.string() + "'");
  }
  return {path, ended.steps, ended.lost, ended.bytes};
}

void Controller::black_box(const std::filesystem::path& folder, double seconds, std::uint64_t most_bytes) {
  const std::lock_guard lock(setters_);
  if (box_) {
    throw std::runtime_error("controller: its black box is on already; end it with `stop_black_box`");
  }
  auto files = std::make_unique<BlackBox>(folder, whole_.name(), num_coordinates(), seconds, most_bytes);
  box_ = std::make_unique<Recorder>(std::move(files), false, newest(), setters_);
  box_->note(newest());
  if (newest_->lifted.load() != nullptr) {
    box_->add_arm(*newest_, held_);
  }
  boxes_.store(box_.get());
}

BlackBoxSummary Controller::stop_black_box() {
  std::unique_ptr<Recorder> box;
  {
    const std::lock_guard lock(setters_);
    if (!box_) {
      throw std::runtime_error("controller: it has no black box; begin with `black_box`");
    }
    boxes_.store(nullptr);
    box = std::move(box_);
  }
  stepper_.wait_until_left();
  Recorder::Ended ended = box->finish();
  std::string trouble = ended.error != 0 ? std::generic_category().message(ended.error) : "";
  if (trouble.empty() && ended.lost > 0) {
    trouble = "the disk was too slow";
  }
  return {std::move(ended.files), ended.steps, ended.lost, ended.bytes, std::move(trouble)};
}

void Controller::note_requests() {
  for (Recorder* const recorder : {recorder_.get(), box_.get()}) {
    if (recorder != nullptr) {
      recorder->note(newest());
    }
  }
}

}  // namespace sidestep
