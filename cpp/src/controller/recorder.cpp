#include "recorder.hpp"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

namespace sidestep {
namespace {

constexpr std::size_t ring_capacity = std::size_t{16} << 20;  // Size of the ring: some 20 s of an arm of 7 joints at 1 kHz [B].
constexpr std::chrono::milliseconds writing_period{2};        // Time between two looks of the writer at the ring.
constexpr std::chrono::microseconds wait_for_room{50};        // Time between two looks of a synchronous step for space.
constexpr std::size_t file_buffer = std::size_t{1} << 18;     // Size of the file's buffer [B].
constexpr int most_recordings = 1'000'000;                    // Number of recordings of one arm in one folder, at most.

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};

recording::PoseRecord to_record(const PoseGoal& goal) {
  const PoseGoalSettings& s = goal.settings;
  return {goal.frame().name,    goal.pose.matrix(),      goal.twist,          s.position_only,
          s.position_stiffness, s.orientation_stiffness, s.posture_stiffness, s.rest};
}

recording::ObstaclesRecord to_record(std::uint64_t number, const Obstacles& obstacles) {
  recording::ObstaclesRecord record{
      number, obstacles.points(), obstacles.velocities(), obstacles.radii(), obstacles.uncertainty(), {}, {}, {}};
  record.order.assign(obstacles.tree().order().begin(), obstacles.tree().order().end());
  for (const auto& [name, count] : obstacles.groups()) {
    record.names.push_back(name);
    record.counts.push_back(count);
  }
  return record;
}

recording::RequestRecord to_record(std::uint64_t number, const Request& request) {
  recording::RequestRecord record;
  record.number = number;
  // A kind of request that is new does not compile until it is recorded here, and given again in a replay.
  std::visit(Overloaded{[](const std::monostate&) {},
                        [&](const Goal& goal) {
                          if (const auto* joint = std::get_if<JointGoal>(&goal)) {
                            record.kind = recording::RequestRecord::Kind::joint_goal;
                            record.position = joint->position;
                            record.velocity = joint->velocity;
                            record.acceleration = joint->acceleration;
                            return;
                          }
                          const auto& pose = std::get<PoseGoal>(goal);
                          record.kind = recording::RequestRecord::Kind::pose_goal;
                          record.poses.push_back(to_record(pose));
                          for (const PoseGoal& other : pose.others) {
                            record.poses.push_back(to_record(other));
                          }
                        },
                        [&](const VelocityRequest& velocity) {
                          record.kind = recording::RequestRecord::Kind::velocity;
                          record.velocity = velocity.velocity;
                        },
                        [&](const TwistRequest& twist) {
                          record.kind = recording::RequestRecord::Kind::twist;
                          record.frame = twist.frame.name;
                          record.twist = twist.twist;
                          record.local = twist.local;
                          record.free_rotation = twist.free == TwistFreedom::rotation;
                        },
                        [&](const TrajectoryRequest& trajectory) {
                          record.kind = recording::RequestRecord::Kind::trajectory;
                          record.q = trajectory.samples->q;
                          record.times = trajectory.samples->times;
                          record.steer = trajectory.behaviour == TrajectoryBehaviour::steer;
                        }},
             request);
  return record;
}

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

bool RecordRing::end() noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  if (dropped_) {
    return false;
  }
  const std::uint64_t size = cursor_ - head - sizeof(std::uint64_t);
  copy_in(head, &size, sizeof size);
  head_.store(cursor_, std::memory_order_release);
  return true;
}

bool RecordRing::take(std::vector<std::byte>& record, std::uint64_t end) {
  const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  if (tail == end) {
    return false;
  }
  std::uint64_t size = 0;
  copy_out(tail, &size, sizeof size);
  record.resize(static_cast<std::size_t>(size));
  copy_out(tail + sizeof size, record.data(), record.size());
  tail_.store(tail + sizeof size + size, std::memory_order_release);
  return true;
}

Recorder::Recorder(const std::filesystem::path& path, const Controller::Impl& first, std::mutex& setters)
    : path_(path),
      setters_(setters),
      ring_(ring_capacity, first.model.settings.synchronous),
      synchronous_(first.model.settings.synchronous) {
  if (first.state_.steps != 0) {
    throw std::runtime_error("controller: recording begins before the first step, but it has made " +
                             std::to_string(first.state_.steps) + "; make another controller");
  }
  recording::HeadRecord head;
  head.sidestep_version = recording::sidestep_version();
  head.compiler = __VERSION__;
  head.instruction_set = name(instruction_set());
  head.arm_number = first.arm_number;
  head.arm_file = recording::arm_bytes(first.model.arm);
  head.settings = recording::to_records(first.model.settings);
  head.fields = recording::fields_of_commands();
  recording::Bytes content;
  recording::Encoder<recording::Bytes> out(content);
  describe(out, head);
  errno = 0;
  file_ = std::fopen(path.string().c_str(), "wb");
  if (file_ == nullptr) {
    throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(),
                            "cannot write recording '" + path.string() + "'");
  }
  std::setvbuf(file_, nullptr, _IOFBF, file_buffer);
  write(std::as_bytes(std::span<const char>(recording::magic)));
  write(recording::chunk(recording::head_tag, content.bytes));
  thread_ = std::thread([this] { run(); });
}

template <class Record>
void Recorder::add(std::string_view tag, const Record& record) {
  recording::Bytes content;
  recording::Encoder<recording::Bytes> out(content);
  describe(out, record);
  requested_.push_back({tag, std::move(content.bytes)});
}

void Recorder::note(const Controller::Impl& newest) {
  if (closed_) {
    return;
  }
  const RequestBoard& board = newest.board();
  const std::shared_ptr<const World> world = board.newest_world();
  const std::uint64_t request_number = board.request_number();
  if (world->number > noted_world_) {
    recording::WorldRecord record{world->number, {}};
    for (const SourceSet& set : world->sources) {
      if (set.number > noted_world_) {
        add(recording::obstacles_tag, to_record(set.number, *set.points));
      }
      record.sources.push_back({set.name, set.id, set.number, set.heard_number, set.time, set.heard, set.valid_for,
                                set.moves_for, set.emptied, set.repeated});
    }
    add(recording::world_tag, record);
    noted_world_ = world->number;
  }
  if (request_number > noted_request_) {
    noted_request_ = request_number;
    add(recording::request_tag, to_record(request_number, board.request(request_number)));
  }
}

void Recorder::add_arm(const Controller::Impl& arm, const std::vector<Controller::Held>& held) {
  if (closed_) {
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
  add(recording::arm_tag, record);
}

void Recorder::begin_step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                          const Eigen::Ref<const Eigen::VectorXd>* bias, double time) noexcept {
  ++step_;
  if (full_) {
    return;
  }
  ring_.begin();
  recording::Encoder<RecordRing> out(ring_);
  out(step_, time, q, v, mass_matrix != nullptr);
  if (mass_matrix != nullptr) {
    out(*mass_matrix, *bias);
  }
}

void Recorder::end_step(Controller::Impl& arm) noexcept {
  using recording::TakenKind;
  if (full_) {
    lost_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  Controller::Impl::Taken& taken = arm.taken_;
  recording::Encoder<RecordRing> out(ring_);
  out(arm.arm_number, arm.inputs_.request().number(), arm.sources_.number(), taken.request, taken.obstacles);
  out(TakenKind::elapsed, arm.clock_.machine().since_end);
  out(TakenKind::interval, arm.clock_.machine().since_begin, arm.clock_.machine().now);
  if (taken.restarts) {
    out(TakenKind::restart);
  }
  if (!synchronous_) {
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
        describe(out, *answer->route);
      }
    }
  }
  out(TakenKind::end);
  recording::write_command(out, arm.command_);
  if (!ring_.end()) {
    full_ = true;
    lost_.fetch_add(1, std::memory_order_relaxed);
  }
  taken = {};
}

void Recorder::run() noexcept {
  try {
    while (true) {
      const bool last = stopping_.load(std::memory_order_acquire);
      write_what_there_is();
      if (last) {
        return;
      }
      std::this_thread::sleep_for(writing_period);
    }
  } catch (...) {  // out of memory
    error_ = error_ != 0 ? error_ : ENOMEM;
    ring_.close();
  }
}

void Recorder::write_what_there_is() {
  // What a step takes comes before it: that was set before the step handed over its record, so that it is noted as soon as no setter
  // is at work.
  const std::uint64_t end = ring_.head();
  std::vector<Requested> requested;
  {
    const std::lock_guard lock(setters_);
    requested.swap(requested_);
  }
  for (const Requested& one : requested) {
    write(recording::chunk(one.tag, one.content));
  }
  while (ring_.take(record_, end)) {
    write(recording::chunk(recording::step_tag, record_));
    ++steps_;
  }
  if (std::fflush(file_) != 0 && error_ == 0) {
    error_ = errno;
  }
}

void Recorder::write(std::span<const std::byte> bytes) {
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size() && error_ == 0) {
    error_ = errno != 0 ? errno : EIO;
  }
  written_ += bytes.size();
}

RecordingSummary Recorder::finish() {
  if (file_ != nullptr) {
    stopping_.store(true, std::memory_order_release);
    thread_.join();
    recording::Bytes content;
    recording::Encoder<recording::Bytes> out(content);
    out(steps_, lost_.load());
    write(recording::chunk(recording::done_tag, content.bytes));
    if (std::fclose(std::exchange(file_, nullptr)) != 0 && error_ == 0) {
      error_ = errno;
    }
    if (error_ != 0) {
      throw std::system_error(error_, std::generic_category(), "cannot write recording '" + path_.string() + "'");
    }
  }
  return {path_, steps_, lost_.load(), written_};
}

void Recorder::finish_quietly() noexcept {
  try {
    if (finish().steps == 0 && !keeps_empty_) {
      std::filesystem::remove(path_);
    }
  } catch (...) {  // the recording is not whole; a replay says so
  }
}

std::filesystem::path next_of_folder(const std::string& name) {
  const char* const folder = std::getenv("SIDESTEP_RECORD");
  if (folder == nullptr || *folder == '\0') {
    return {};
  }
  std::filesystem::create_directories(folder);
  std::string stem;
  for (const char c : name) {
    stem += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '.' ? c : '_';
  }
  for (int n = 1; n <= most_recordings; ++n) {
    char number[32];
    std::snprintf(number, sizeof number, "-%03d.step", n);
    const std::filesystem::path path = std::filesystem::path(folder) / (stem + number);
    if (std::FILE* const made = std::fopen(path.string().c_str(), "wbx")) {  // no other program takes this name
      std::fclose(made);
      return path;
    }
    if (const int refused = errno; !std::filesystem::exists(path)) {
      throw std::system_error(refused, std::generic_category(), "cannot write recording '" + path.string() + "'");
    }
  }
  throw std::runtime_error("there are too many recordings in '" + std::string(folder) + "'");
}

}  // namespace sidestep
