// Gives a controller what a recording holds.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <system_error>
#include <utility>

#include "impl.hpp"
#include "recorder.hpp"
#include "recording_content.hpp"

namespace sidestep {
namespace {

constexpr std::uint64_t largest_chunk = std::uint64_t{1} << 32;  // Largest chunk: some 70 million obstacle points [B].
constexpr std::uint64_t steps_between_checks = 256;  // Steps between two looks at whether the replay is interrupted.

/// The chunks of a recording, one after the other.
class ChunkReader {
 public:
  explicit ChunkReader(const std::filesystem::path& path) : path_(path) {
    errno = 0;
    stream_.open(path, std::ios::binary);
    std::error_code failed;
    size_ = stream_ ? std::filesystem::file_size(path, failed) : 0;
    if (!stream_ || failed) {
      throw std::system_error(failed       ? failed.value()
                              : errno != 0 ? errno
                                           : EIO,
                              std::generic_category(), "cannot read recording '" + path.string() + "'");
    }
    std::string begin(recording::magic.size(), '\0');
    if (!stream_.read(begin.data(), static_cast<std::streamsize>(begin.size())) || begin != recording::magic) {
      throw std::invalid_argument("recording '" + path.string() + "': it is not a recording of a controller's steps");
    }
    at_ = begin.size();
  }

  /// Whether there is a next whole chunk, which `tag` and `content` then are.
  bool next() {
    const std::uint64_t header = recording::tag_size + sizeof(std::uint64_t), check = sizeof(std::uint32_t);
    begin_ = at_;
    if (size_ - at_ < header + check) {
      return false;
    }
    whole_.resize(static_cast<std::size_t>(header));
    read(0);
    recording::Decoder in(std::span<const std::byte>(whole_).subspan(recording::tag_size));
    const auto length = in.take<std::uint64_t>();
    if (length > largest_chunk || length > size_ - at_ - check) {
      return false;
    }
    whole_.resize(static_cast<std::size_t>(header + length + check));
    read(static_cast<std::size_t>(header));
    const std::span<const std::byte> whole(whole_);
    recording::Decoder end(whole.last(check));
    if (end.take<std::uint32_t>() != recording::crc32(whole.first(whole.size() - check))) {
      damaged_ = true;
      return false;
    }
    tag = std::string_view(reinterpret_cast<const char*>(whole_.data()), recording::tag_size);
    content = whole.subspan(static_cast<std::size_t>(header), static_cast<std::size_t>(length));
    return true;
  }

  bool damaged() const noexcept { return damaged_; }
  std::uint64_t begin() const noexcept { return begin_; }

  std::string_view tag;
  std::span<const std::byte> content;

 private:
  void read(std::size_t from) {
    const auto count = static_cast<std::streamsize>(whole_.size() - from);
    if (!stream_.read(reinterpret_cast<char*>(whole_.data() + from), count)) {
      throw std::system_error(EIO, std::generic_category(), "cannot read recording '" + path_.string() + "'");
    }
    at_ += static_cast<std::uint64_t>(count);
  }

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, at_ = 0, begin_ = 0;
  bool damaged_ = false;
  std::vector<std::byte> whole_;
};

template <class Record>
Record read_record(std::span<const std::byte> content) {
  recording::Decoder in(content);
  Record record;
  describe(in, record);
  return record;
}

recording::HeadRecord read_head(ChunkReader& chunks, const std::filesystem::path& path) {
  const std::string what = "recording '" + path.string() + "': ";
  if (!chunks.next() || chunks.tag != recording::head_tag) {
    throw std::invalid_argument(what + "its head is damaged or missing");
  }
  const auto version = recording::Decoder(chunks.content).take<std::uint32_t>();
  if (version != recording::format) {
    throw std::invalid_argument(what + "it has format version " + std::to_string(version) + ", this Sidestep reads version " +
                                std::to_string(recording::format));
  }
  return read_record<recording::HeadRecord>(chunks.content);
}

RecordingHeader to_header(const recording::HeadRecord& head) {
  RecordingHeader header{
      head.version, head.sidestep_version, head.compiler, head.instruction_set, recording::arm_of(head.arm_file), {}, {}};
  header.settings = recording::to_settings(head.settings, header.notes);
  const std::vector<recording::FieldRecord> now = recording::fields_of_commands();
  const auto missing = [](const std::vector<recording::FieldRecord>& in, const recording::FieldRecord& field) {
    return std::none_of(in.begin(), in.end(),
                        [&](const auto& other) { return other.name == field.name && other.kind == field.kind; });
  };
  for (const auto& field : head.fields) {
    if (missing(now, field)) {
      header.notes.push_back("field " + field.name + " of a command is recorded, and there is none now: not compared");
    }
  }
  for (const auto& field : now) {
    if (missing(head.fields, field)) {
      header.notes.push_back("field " + field.name + " of a command is not in the recording: not compared");
    }
  }
  if (head.compiler != __VERSION__) {
    header.notes.push_back("compiler: recorded with " + head.compiler + ", now " + __VERSION__);
  }
  if (head.instruction_set != name(instruction_set())) {
    header.notes.push_back("instruction set: recorded with " + head.instruction_set + ", now " + name(instruction_set()));
  }
  if (head.sidestep_version != recording::sidestep_version()) {
    header.notes.push_back("Sidestep: recorded with " + head.sidestep_version + ", now " + recording::sidestep_version());
  }
  return header;
}

void note_differences(const ControllerSettings& recorded, const ControllerSettings& used, std::vector<std::string>& notes) {
  std::map<std::string, double> before;
  for (const auto& one : recording::to_records(recorded)) {
    before[one.name] = one.value;
  }
  const auto in_short = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    return std::string(text);
  };
  for (const auto& one : recording::to_records(used)) {
    const auto was = before.find(one.name);
    if (was == before.end() || was->second != one.value) {
      notes.push_back("setting " + one.name + ": recorded " + (was == before.end() ? "without" : in_short(was->second)) +
                      ", replayed with " + in_short(one.value));
    }
  }
}

Obstacles obstacles_of(const recording::ObstaclesRecord& record) {
  if (record.points.cols() == 0) {
    return Obstacles::none();
  }
  Obstacles made = Obstacles::in_order(record.points, record.radii, record.velocities, record.uncertainty,
                                       {record.order.begin(), record.order.end()});
  return record.names.size() == 1 && record.names.front().empty()
             ? made
             : made.named(record.names, {record.counts.begin(), record.counts.end()});
}

}  // namespace

/// A controller without threads that takes the steps of a recording.
class Replay {
 public:
  Replay(const recording::HeadRecord& head, Arm arm, ControllerSettings settings)
      : fields_(head.fields), controller_(std::move(arm), std::move(settings), false) {
    controller_.impl_->arm_number = head.arm_number;
  }

  void keep(std::string_view tag, std::span<const std::byte> content) {
    if (tag == recording::request_tag) {
      auto record = read_record<recording::RequestRecord>(content);
      const std::uint64_t number = record.number;
      requests_.insert_or_assign(number, std::move(record));
    } else if (tag == recording::obstacles_tag) {
      auto record = read_record<recording::ObstaclesRecord>(content);
      const std::uint64_t number = record.number;
      obstacles_.insert_or_assign(number, std::make_shared<const Obstacles>(obstacles_of(record)));
    } else if (tag == recording::world_tag) {
      auto record = read_record<recording::WorldRecord>(content);
      const std::uint64_t number = record.number;
      worlds_.insert_or_assign(number, std::move(record));
    } else if (tag == recording::arm_tag) {
      auto record = read_record<recording::ArmRecord>(content);
      const std::uint64_t number = record.number;
      arms_.insert_or_assign(number, std::move(record));
    }
  }

  /// Makes the step that a chunk holds; the first field that differs. Throws std::invalid_argument where it holds none.
  std::optional<ReplayDifference> step(std::span<const std::byte> content);

  std::uint64_t num_steps() const noexcept { return step_; }

 private:
  using Impl = Controller::Impl;

  void give_request(std::uint64_t number);
  void give_world(std::uint64_t number);
  void give_arm(std::uint64_t number);
  void give_taken(recording::Decoder& in);
  Request request_of(const recording::RequestRecord& record, const Impl& impl) const;

  std::vector<recording::FieldRecord> fields_;
  Controller controller_;
  std::map<std::uint64_t, recording::RequestRecord> requests_;
  std::map<std::uint64_t, std::shared_ptr<const Obstacles>> obstacles_;
  std::map<std::uint64_t, recording::WorldRecord> worlds_;
  std::map<std::uint64_t, recording::ArmRecord> arms_;
  std::uint64_t step_ = 0, request_ = 0, world_ = 0;
};

std::optional<ReplayDifference> Replay::step(std::span<const std::byte> content) {
  recording::Decoder in(content);
  std::uint64_t number = 0, arm = 0, request = 0, obstacles = 0, request_before = 0, obstacles_before = 0;
  double time = 0.0;  // that the step is told; NaN: none
  Eigen::VectorXd q, v, bias;
  Eigen::MatrixXd mass_matrix;
  bool dynamics = false;
  in(number, time, q, v, dynamics);
  if (dynamics) {
    in(mass_matrix, bias);
  }
  in(arm, request, obstacles, request_before, obstacles_before);
  if (number != step_ + 1) {
    throw std::invalid_argument("step " + std::to_string(number) + " follows step " + std::to_string(step_));
  }
  // In the order in which a step takes over: an arm with what was set before, then what was set since, then results of workers.
  give_request(request_before);
  give_world(obstacles_before);
  const Impl& now = *controller_.impl_;
  const Impl* const lifted = now.lifted.load();
  if (arm != now.arm_number && (lifted == nullptr || arm != lifted->arm_number)) {
    give_arm(arm);
  }
  controller_.take_over();
  give_request(request);
  give_world(obstacles);
  give_taken(in);
  Impl& impl = *controller_.impl_;
  step_ = number;
  const Eigen::Ref<const Eigen::MatrixXd> M(mass_matrix);
  const Eigen::Ref<const Eigen::VectorXd> h(bias);
  const Command& command = impl.step(q, v, dynamics ? ToldDynamics{&M, &h} : ToldDynamics{}, time);
  std::optional<ReplayDifference> difference = recording::first_difference(fields_, in.rest(), command);
  if (impl.arm_number != arm) {
    difference = ReplayDifference{0, "arm", "number " + std::to_string(arm), "number " + std::to_string(impl.arm_number)};
  }
  if (difference) {
    difference->step = number;
  }
  return difference;
}

void Replay::give_request(std::uint64_t number) {
  if (number == 0 || number == request_) {
    return;
  }
  const auto found = requests_.find(number);
  if (found == requests_.end()) {
    throw std::invalid_argument("its request " + std::to_string(number) + " is missing");
  }
  request_ = number;
  controller_.tell([&](Impl& impl) {
    impl.board().number_next_request(number);
    impl.put(request_of(found->second, impl));
  });
  requests_.erase(requests_.begin(), found);  // the newest stays, for one that was taken twice
}

void Replay::give_world(std::uint64_t number) {
  if (number == 0 || number == world_) {
    return;
  }
  const auto found = worlds_.find(number);
  if (found == worlds_.end()) {
    throw std::invalid_argument("its obstacles " + std::to_string(number) + " are missing");
  }
  world_ = number;
  World world;
  world.number = number;
  std::uint64_t oldest = number;
  for (const recording::SourceRecord& record : found->second.sources) {
    const auto points = obstacles_.find(record.number);
    if (points == obstacles_.end()) {
      throw std::invalid_argument("set " + std::to_string(record.number) + " of its source '" + record.name + "' is missing");
    }
    world.sources.push_back({record.name, record.id, record.number, record.time, record.heard, record.heard_number,
                             record.valid_for, record.moves_for, record.emptied, record.repeated, points->second});
    oldest = std::min(oldest, record.number);
  }
  world.obstacles = join(world.sources);
  const auto given = std::make_shared<const World>(std::move(world));
  controller_.tell([&](Impl& impl) { impl.put(given); });
  worlds_.erase(worlds_.begin(), found);
  obstacles_.erase(obstacles_.begin(), obstacles_.lower_bound(oldest));
}

void Replay::give_arm(std::uint64_t number) {
  const auto found = arms_.find(number);
  if (found == arms_.end()) {
    throw std::invalid_argument("its arm " + std::to_string(number) + " is missing");
  }
  const recording::ArmRecord& record = found->second;
  const Arm arm = recording::arm_of(record.file);
  auto fresh = std::make_unique<Impl>(arm, controller_.settings_, controller_.command_, false);
  for (std::size_t k = 0; k < record.resting.size(); ++k) {
    fresh->resting().add({static_cast<Eigen::Index>(record.resting[k]), record.clearances[static_cast<Eigen::Index>(k)]});
  }
  if (record.lifted_number != 0) {
    fresh->lifted = new Impl(recording::arm_of(record.lifted_file), controller_.settings_, controller_.command_, false);
  }
  controller_.arm_count_ = number - 1;
  controller_.install(std::move(fresh), arm, {});
}

void Replay::give_taken(recording::Decoder& in) {
  using recording::TakenKind;
  Impl& impl = *controller_.impl_;
  Clock::Machine machine;  // Recordings of 0.2 have no interval: every step was on time.
  for (TakenKind kind = in.take<TakenKind>(); kind != TakenKind::end; kind = in.take<TakenKind>()) {
    switch (kind) {
      case TakenKind::posture: {
        FoundPosture found = impl.inputs_.goal().found_postures().current();
        Posture& p = found.posture;
        in(found.request_number, found.attempt, p.q, p.position_error, p.rotation_error, p.clearance, p.touches_itself);
        impl.inputs_.goal().found_postures().put(std::move(found));
        break;
      }
      case TakenKind::activations: {
        FoundActivations found;
        in(found.request_number, found.posture_attempt, found.values, found.target_blocked);
        impl.worker_.activations().put(std::move(found));
        break;
      }
      case TakenKind::trajectory: {
        FoundTrajectory found = impl.look_ahead_.buffer().current();
        Eigen::VectorXd target, position, velocity;
        in(found.time, found.request_number, found.avoid, found.duration, target, position, velocity);
        found.trajectory = AvoidanceTrajectory(impl.model.arm.robot().limits(), position, velocity, std::move(target));
        impl.look_ahead_.buffer().put(std::move(found));
        break;
      }
      case TakenKind::restart: impl.restart(); break;
      case TakenKind::elapsed: machine.since_end = in.take<double>(); break;
      case TakenKind::interval: in(machine.since_begin, machine.now); break;
      case TakenKind::look: {
        OnlinePlanner::Looked look;
        in(look.time, look.duration);
        if (OnlinePlanner* const planner = impl.planner()) {
          planner->give(look);
        }
        break;
      }
      case TakenKind::answer: {
        OnlinePlanner::Answer answer;
        bool has_route = false;
        in(answer.goal_number, answer.route_number, answer.path_number, answer.status, answer.progress, has_route);
        if (has_route) {
          TimedPath route;
          describe(in, route);
          answer.route = std::make_shared<const TimedPath>(std::move(route));
        }
        if (OnlinePlanner* const planner = impl.planner()) {
          planner->give(std::move(answer));
        }
        break;
      }
      default: throw std::invalid_argument("it took over something that this Sidestep does not know");
    }
  }
  impl.clock_.give(machine);
}

Request Replay::request_of(const recording::RequestRecord& record, const Impl& impl) const {
  using Kind = recording::RequestRecord::Kind;
  const Robot& robot = impl.model.arm.robot();
  switch (record.kind) {
    case Kind::none: return {};
    case Kind::joint_goal: return Goal(JointGoal(record.position, record.velocity, record.acceleration));
    case Kind::pose_goal: {
      std::optional<PoseGoal> whole;
      for (const recording::PoseRecord& pose : record.poses) {
        const PoseGoalSettings asked{pose.position_only, pose.position_stiffness, pose.orientation_stiffness, pose.rest,
                                     pose.posture_stiffness};
        const Eigen::Isometry3d X(pose.pose);
        PoseGoal goal(robot, pose.frame, X, asked, pose.twist);
        goal.pose = X;
        if (whole) {
          whole->add(std::move(goal));
        } else {
          whole = std::move(goal);
        }
      }
      if (!whole) {
        throw std::invalid_argument("its pose goal has no pose");
      }
      return Goal(std::move(*whole));
    }
    case Kind::velocity: return VelocityRequest{record.velocity};
    case Kind::twist:
      return TwistRequest{moved_frame(robot, record.frame, "its twist"), record.twist, record.local,
                          record.free_rotation ? TwistFreedom::rotation : TwistFreedom::none};
    case Kind::trajectory:
      return TrajectoryRequest{
          JointTrajectory(robot, record.q, record.times, impl.model.usable.velocity, impl.model.usable.acceleration),
          record.steer ? TrajectoryBehaviour::steer : TrajectoryBehaviour::keep_path,
          std::make_shared<const TrajectorySamples>(TrajectorySamples{record.q, record.times})};
  }
  throw std::invalid_argument("its request is of a kind that this Sidestep does not know");
}

RecordingHeader read_recording_header(const std::filesystem::path& path) {
  ChunkReader chunks(path);
  return to_header(read_head(chunks, path));
}

ReplayResult replay(const std::filesystem::path& path, const std::optional<Arm>& arm,
                    const std::optional<ControllerSettings>& settings, const Interrupted& interrupted) {
  ChunkReader chunks(path);
  const recording::HeadRecord head = read_head(chunks, path);
  RecordingHeader header = to_header(head);
  ReplayResult result;
  result.notes = std::move(header.notes);
  result.arm = header.arm.name();
  if (settings) {
    note_differences(header.settings, *settings, result.notes);
  }
  if (arm && arm->content_hash() != header.arm.content_hash()) {
    result.notes.push_back("arm: recorded '" + header.arm.name() + "' with hash " + header.arm.content_hash().substr(0, 12) +
                           ", replayed with '" + arm->name() + "', " + arm->content_hash().substr(0, 12));
  }
  Replay run(head, arm ? *arm : header.arm, settings ? *settings : header.settings);
  try {
    while (!result.difference && chunks.next()) {
      if (chunks.tag == recording::step_tag) {
        if (run.num_steps() % steps_between_checks == 0 && interrupted()) {
          throw Interruption();
        }
        result.difference = run.step(chunks.content);
      } else if (chunks.tag == recording::done_tag) {
        recording::Decoder in(chunks.content);
        const auto steps = in.take<std::uint64_t>();
        result.lost = in.take<std::uint64_t>();
        result.complete = true;
        if (steps != run.num_steps()) {
          result.damage =
              "it says that it holds " + std::to_string(steps) + " steps, there are " + std::to_string(run.num_steps());
        }
      } else {
        run.keep(chunks.tag, chunks.content);
      }
    }
    if (chunks.damaged()) {
      result.damage = "the bytes from " + std::to_string(chunks.begin()) + " on, after step " +
                      std::to_string(run.num_steps()) + ", are not those that were written";
    }
  } catch (const std::invalid_argument& error) {
    result.damage = "after step " + std::to_string(run.num_steps()) + ": " + error.what();
  }
  result.steps = run.num_steps();
  result.seconds = static_cast<double>(result.steps) * header.settings.period;
  return result;
}

}  // namespace sidestep
