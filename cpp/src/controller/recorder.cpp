#include "recorder.hpp"

#include <cerrno>
#include <chrono>
#include <new>
#include <system_error>
#include <utility>

#include "recorded_content.hpp"

namespace sidestep {
namespace {

constexpr std::size_t ring_capacity = std::size_t{16} << 20;  // Size of the ring: some 20 s of an arm of 7 joints at 1 kHz [B].
constexpr std::size_t most_requested = std::size_t{512}
                                       << 20;           // Size of obstacles and requests that wait for the disk, at most [B].
constexpr std::size_t point_size = 130;                 // Size of a point of obstacles with its share of the tree [B].
constexpr std::chrono::milliseconds writing_period{2};  // Time between two looks of the writer at the ring.

}  // namespace

Recorder::Recorder(std::unique_ptr<RecordSink> sink, bool whole, const Controller::Impl& arm, std::mutex& setters)
    : whole_(whole),
      setters_(setters),
      ring_(ring_capacity, arm.model.settings.synchronous),
      synchronous_(arm.model.settings.synchronous),
      sink_(std::move(sink)) {
  recording::HeadRecord head;
  head.sidestep_version = recording::sidestep_version();
  head.compiler = __VERSION__;
  head.instruction_set = name(instruction_set());
  head.arm_number = arm.arm_number;
  head.arm_file = recording::arm_bytes(arm.model.arm);
  head.settings = recording::to_records(arm.model.settings);
  head.fields = recording::fields_of_commands();
  head.whole = whole;
  recording::Bytes content;
  recording::Encoder<recording::Bytes> out(content);
  describe(out, head);
  sink_->write(recording::RecordKind::head, time_, content.bytes);
  thread_ = std::thread([this] { run(); });
}

Recorder::~Recorder() {
  try {
    const Ended ended = finish();
    if (ended.steps == 0 && !keeps_empty_) {
      for (const std::filesystem::path& path : ended.files) {
        std::filesystem::remove(path);
      }
    }
  } catch (...) {  // the recording is not whole; a replay says so
  }
}

template <class Record>
void Recorder::add(recording::RecordKind kind, const Record& record) {
  recording::Bytes content;
  recording::Encoder<recording::Bytes> out(content);
  describe(out, record);
  const std::size_t size = content.bytes.size();
  add(Requested{kind, std::move(content.bytes), {}}, size);
}

void Recorder::add(const RecordedSet& set) {
  add(Requested{recording::RecordKind::obstacles, {}, set}, point_size * static_cast<std::size_t>(set.points->size()));
}

void Recorder::add(Requested requested, std::size_t size) {
  requested_bytes_ += size;
  if (requested_bytes_ > most_requested) {  // the disk is too slow
    failed_.store(true, std::memory_order_relaxed);
  }
  if (takes_more()) {
    requested_.push_back(std::move(requested));
  }
}

bool Recorder::takes_more() {
  if (failed_.load(std::memory_order_relaxed)) {
    closed_ = true;
    std::vector<Requested>().swap(requested_);  // nobody writes them any more
  }
  return !closed_;
}

void Recorder::note(const Controller::Impl& newest) {
  if (!takes_more()) {
    return;
  }
  const RequestBoard& board = newest.board();
  const std::shared_ptr<const World> world = board.newest_world();
  const std::uint64_t request_number = board.request_number();
  if (world->number > noted_world_) {
    recording::WorldRecord record{world->number, {}};
    for (const SourceSet& set : world->sources) {
      if (set.number > noted_world_) {
        add(RecordedSet{set.number, set.id, set.points});
      }
      record.sources.push_back({set.name, set.id, set.number, set.heard_number, set.time, set.heard, set.valid_for,
                                set.moves_for, set.emptied, set.repeated});
    }
    add(recording::RecordKind::world, record);
    noted_world_ = world->number;
  }
  if (request_number > noted_request_) {
    noted_request_ = request_number;
    add(recording::RecordKind::request, to_record(request_number, board.request(request_number)));
  }
}

void Recorder::add_arm(const Controller::Impl& arm, const std::vector<Controller::Held>& held) {
  if (!takes_more()) {
    return;
  }
  recording::ArmRecord record;
  record.number = arm.arm_number;
  record.file = recording::arm_bytes(arm.model.arm);
  if (const Controller::Impl* const lifted = arm.lifted.load()) {
    record.lifted_number = lifted->arm_number;
    record.lifted_file = recording::arm_bytes(lifted->model.arm);
  }
  record.clearances.resize(static_cast<Eigen::Index>(arm.resting().all().size()));
  for (const RestingClearances::One& one : arm.resting().all()) {
    record.clearances[static_cast<Eigen::Index>(record.resting.size())] = one.clearance;
    record.resting.push_back(one.coordinate);
  }
  for (const Controller::Held& one : held) {
    record.attached.push_back(one.object.name);
  }
  add(recording::RecordKind::arm, record);
}

void Recorder::begin_step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                          const Eigen::Ref<const Eigen::VectorXd>* bias, double time) noexcept {
  const std::uint64_t number = made_.load(std::memory_order_relaxed) + 1;
  made_.store(number, std::memory_order_relaxed);
  full_ = full_ || failed_.load(std::memory_order_relaxed);
  if (full_) {
    return;
  }
  ring_.begin();
  recording::Encoder<RecordRing> out(ring_);
  out(number, time, q, v, mass_matrix != nullptr);
  if (mass_matrix != nullptr) {
    out(*mass_matrix, *bias);
  }
}

void Recorder::end_step(Controller::Impl& arm) noexcept {
  using recording::TakenKind;
  if (!full_) {
    const Controller::Impl::Taken& taken = arm.taken_;
    const Clock::Machine& machine = arm.clock_.machine();
    recording::Encoder<RecordRing> out(ring_);
    out(arm.arm_number, arm.inputs_.request().number(), arm.sources_.number(), whole_ ? taken.request : 0,
        whole_ ? taken.obstacles : 0);
    out(TakenKind::elapsed, machine.since_end);
    out(TakenKind::interval, machine.since_begin, machine.now);
    if (whole_) {
      write_taken(out, arm);
    }
    out(TakenKind::end);
    const auto place = static_cast<recording::CommandPlace>(ring_.written());
    recording::write_command(out, arm.command_);
    out(place);
    full_ = !ring_.end(arm.tick().time - arm.tick().offset);
  }
  if (whole_) {
    arm.taken_ = {};
  }
}

void Recorder::write_taken(recording::Encoder<RecordRing>& out, Controller::Impl& arm) noexcept {
  using recording::TakenKind;
  const Controller::Impl::Taken& taken = arm.taken_;
  if (taken.restarts) {
    out(TakenKind::restart);
  }
  if (taken.is_told) {
    out(TakenKind::told, arm.state_.told.position, arm.state_.told.velocity, arm.state_.told.acceleration);
  }
  if (taken.pauses) {
    out(TakenKind::pause, arm.state_.paused);
  }
  if (synchronous_) {
    return;  // a replay finds all of it again
  }
  if (const auto* found = taken.goal.posture) {
    const Posture& p = found->posture;
    out(TakenKind::posture, found->request_number, found->attempt, p.q, p.position_error, p.rotation_error, p.clearance,
        p.touches_itself);
  }
  if (const auto* found = taken.activations) {
    out(TakenKind::activations, found->request_number, found->posture_attempt, found->values, found->target_blocked);
  }
  if (const auto* found = taken.trajectory) {
    const AvoidanceTrajectory& t = found->trajectory;
    out(TakenKind::trajectory, found->time, found->request_number, found->avoid, found->duration, t.target(), t.position(),
        t.velocity());
  }
  if (const auto* look = taken.goal.look) {
    out(TakenKind::look, look->time, look->duration);
  }
  if (const auto* answer = taken.goal.answer) {
    out(TakenKind::answer, answer->goal_number, answer->route_number, answer->path_number, answer->status, answer->progress,
        answer->route != nullptr);
    if (answer->route != nullptr) {
      recording::describe(out, *answer->route);
    }
  }
}

void Recorder::run() noexcept {
  try {
    while (!failed_.load(std::memory_order_relaxed)) {
      const bool last = stopping_.load(std::memory_order_acquire);
      write_what_there_is();
      if (last) {
        return;
      }
      std::this_thread::sleep_for(writing_period);
    }
  } catch (const std::system_error& error) {
    return fail(error.code().value());
  } catch (const std::bad_alloc&) {
    return fail(ENOMEM);
  } catch (...) {
    return fail(EIO);
  }
  fail(error_);
}

void Recorder::fail(int error) noexcept {
  error_ = error_ != 0 ? error_ : error;
  failed_.store(true, std::memory_order_relaxed);
  ring_.close();
}

void Recorder::write_what_there_is() {
  // What a step takes comes before it: that was set before the step handed over its record, so that it is noted as soon as no setter
  // is at work.
  const std::uint64_t end = ring_.head();
  std::vector<Requested> requested;
  {
    const std::lock_guard lock(setters_);
    requested.swap(requested_);
    requested_bytes_ = 0;
  }
  for (const Requested& one : requested) {
    if (one.set.points) {
      sink_->write_set(time_, one.set);
    } else {
      sink_->write(one.kind, time_, one.content);
    }
  }
  std::uint64_t steps = 0;
  for (; ring_.take(record_, time_, end); ++steps) {
    sink_->write(recording::RecordKind::step, time_, record_);
  }
  sink_->flush();
  if (sink_->error() != 0) {
    return fail(sink_->error());
  }
  steps_ += steps;
}

Recorder::Ended Recorder::finish() {
  if (thread_.joinable()) {
    stopping_.store(true, std::memory_order_release);
    thread_.join();
    ring_.close();
    recording::Bytes content;
    recording::Encoder<recording::Bytes> out(content);
    out(steps_, made_.load() - steps_);
    try {
      if (error_ == 0 && sink_->error() == 0) {
        sink_->write(recording::RecordKind::done, time_, content.bytes);
      }
    } catch (const std::system_error& error) {
      error_ = error.code().value();
    }
    sink_->close();
    error_ = error_ != 0 ? error_ : sink_->error();
  }
  return {steps_, made_.load() - steps_, sink_->bytes(), error_, sink_->files()};
}

}  // namespace sidestep
