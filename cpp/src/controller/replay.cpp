// Gives a controller what a recording holds.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <utility>

#include "impl.hpp"
#include "recorded_worlds.hpp"
#include "recording_reader.hpp"

namespace sidestep {
namespace {

constexpr std::uint64_t steps_between_checks = 256;  // Steps between two looks at whether the replay is interrupted.

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

}  // namespace

/// A controller without threads that takes the steps of a recording.
class Replay {
 public:
  Replay(const recording::HeadRecord& head, Arm arm, ControllerSettings settings)
      : commands_(head.fields),
        has_command_place_(head.version > recording::step_file_format),
        controller_(std::move(arm), std::move(settings), false) {
    controller_.impl_->arm_number = head.arm_number;
    worlds_.begin_file(head.version);
  }

  /// Keeps a record that is no step until a step takes it.
  void keep(recording::RecordKind kind, std::span<const std::byte> content) {
    if (kind == recording::RecordKind::request) {
      auto record = recording::read_record<recording::RequestRecord>(content);
      const std::uint64_t number = record.number;
      requests_.insert_or_assign(number, std::move(record));
    } else if (kind == recording::RecordKind::obstacles) {
      worlds_.keep_set(content);
    } else if (kind == recording::RecordKind::world) {
      worlds_.keep_world(content);
    } else if (kind == recording::RecordKind::arm) {
      auto record = recording::read_record<recording::ArmRecord>(content);
      const std::uint64_t number = record.number;
      arms_.insert_or_assign(number, std::move(record));
    }
  }

  /// Makes the step that a record holds; the first field that differs. Throws std::invalid_argument where it holds none.
  std::optional<ReplayDifference> step(std::span<const std::byte> content);

  std::uint64_t num_steps() const noexcept { return step_; }

 private:
  using Impl = Controller::Impl;

  void give_request(std::uint64_t number);
  void give_world(std::uint64_t number);
  void give_arm(std::uint64_t number);
  void give_taken(recording::Decoder& in);
  Request request_of(const recording::RequestRecord& record, const Impl& impl) const;

  const recording::CommandReader commands_;
  const bool has_command_place_;
  Controller controller_;
  std::map<std::uint64_t, recording::RequestRecord> requests_;
  RecordedWorlds worlds_;
  std::map<std::uint64_t, recording::ArmRecord> arms_;
  std::uint64_t step_ = 0, request_ = 0, world_ = 0;
};

std::optional<ReplayDifference> Replay::step(std::span<const std::byte> content) {
  recording::Decoder in(content);
  recording::StepInputs s;
  recording::read_step_inputs(in, s);
  if (s.number != step_ + 1) {
    throw std::invalid_argument("step " + std::to_string(s.number) + " follows step " + std::to_string(step_));
  }
  // In the order in which a step takes over: an arm with what was set before, then what was set since, then results of workers.
  give_request(s.request_before);
  give_world(s.obstacles_before);
  const Impl& now = *controller_.impl_;
  const Impl* const lifted = now.lifted.load();
  if (s.arm != now.arm_number && (lifted == nullptr || s.arm != lifted->arm_number)) {
    give_arm(s.arm);
  }
  controller_.take_over();
  give_request(s.request);
  give_world(s.obstacles);
  give_taken(in);
  Impl& impl = *controller_.impl_;
  step_ = s.number;
  const Eigen::Ref<const Eigen::MatrixXd> M(s.mass_matrix);
  const Eigen::Ref<const Eigen::VectorXd> h(s.bias);
  const Command& command = impl.step(s.q, s.v, s.dynamics ? ToldDynamics{&M, &h} : ToldDynamics{}, s.time);
  const std::span<const std::byte> recorded = has_command_place_ ? recording::command_of(content) : in.rest();
  std::optional<ReplayDifference> difference = commands_.first_difference(recorded, command);
  if (impl.arm_number != s.arm) {
    difference = ReplayDifference{0, "arm", "number " + std::to_string(s.arm), "number " + std::to_string(impl.arm_number)};
  }
  if (difference) {
    difference->step = s.number;
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
  world_ = number;
  const auto given = std::make_shared<const World>(worlds_.take(number));
  controller_.tell([&](Impl& impl) { impl.put(given); });
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
      case TakenKind::told: {
        Eigen::VectorXd q, v, a;
        in(q, v, a);
        impl.continue_from(q, v, a);
        break;
      }
      case TakenKind::pause: {
        const bool paused = in.take<bool>();
        controller_.paused_ = paused;  // for the steps after this one
        impl.pause(paused);
        break;
      }
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
          recording::describe(in, route);
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
  return recording::to_header(recording::RecordingReader(path).head);
}

ReplayResult replay(const std::filesystem::path& path, const std::optional<Arm>& arm,
                    const std::optional<ControllerSettings>& settings, const Interrupted& interrupted) {
  recording::RecordingReader records(path);
  RecordingHeader header = recording::to_header(records.head);
  if (!header.whole) {
    throw std::invalid_argument(
        "recording '" + path.string() +
        "': it is of a black box, which begins in the middle of a motion, so that it cannot be replayed; "
        "read it with `sidestep report` or load_recording");
  }
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
  Replay run(records.head, arm ? *arm : header.arm, settings ? *settings : header.settings);
  try {
    while (!result.difference && records.next()) {
      if (records.kind == recording::RecordKind::step) {
        if (run.num_steps() % steps_between_checks == 0 && interrupted()) {
          throw Interruption();
        }
        result.difference = run.step(records.content);
      } else if (records.kind == recording::RecordKind::done) {
        recording::Decoder in(records.content);
        const auto steps = in.take<std::uint64_t>();
        result.lost = in.take<std::uint64_t>();
        result.complete = true;
        if (steps != run.num_steps()) {
          result.damage =
              "it says that it holds " + std::to_string(steps) + " steps, there are " + std::to_string(run.num_steps());
        }
      } else {
        run.keep(records.kind, records.content);
      }
    }
    if (const std::string where = records.damage(); !where.empty()) {
      result.damage = where + ", after step " + std::to_string(run.num_steps()) + ", are not those that were written";
    }
  } catch (const std::invalid_argument& error) {
    result.damage = "after step " + std::to_string(run.num_steps()) + ": " + error.what();
  }
  result.steps = run.num_steps();
  result.seconds = static_cast<double>(result.steps) * header.settings.period;
  return result;
}

}  // namespace sidestep
