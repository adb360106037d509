#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "recording_bytes.hpp"
#include "sidestep/controller/command.hpp"
#include "sidestep/controller/recording.hpp"
#include "sidestep/math/instruction_set.hpp"
#include "sidestep/planning/timed_path.hpp"

// What the records of a recording hold, see recording.hpp. Each `describe` serves both directions.
namespace sidestep::recording {

constexpr std::uint32_t format = 4;            // in MCAP files
constexpr std::uint32_t step_file_format = 2;  // in the files of Sidestep 0.2

enum class RecordKind : std::uint8_t { head, arm, world, request, obstacles, step, done };
constexpr std::size_t num_record_kinds = 7;
/// Channel of each kind.
constexpr std::array<std::string_view, num_record_kinds> record_topics{
    "/sidestep/head",      "/sidestep/arm",  "/sidestep/world", "/sidestep/request",
    "/sidestep/obstacles", "/sidestep/step", "/sidestep/done"};
constexpr std::string_view record_encoding = "sidestep";

template <class T, class Record>
concept Of = std::is_same_v<std::remove_const_t<T>, Record>;

struct PoseRecord {
  std::string frame;
  Eigen::Matrix4d pose;
  Vector6d twist;
  bool position_only;
  double position_stiffness, orientation_stiffness, posture_stiffness;
  Eigen::VectorXd rest;
};
void describe(auto& archive, Of<PoseRecord> auto& p) {
  archive(p.frame, p.pose, p.twist, p.position_only, p.position_stiffness, p.orientation_stiffness, p.posture_stiffness,
          p.rest);
}

/// What the arm is to do, as a setter took it: the members that its kind has.
struct RequestRecord {
  enum class Kind : std::uint8_t { none, joint_goal, pose_goal, velocity, twist, trajectory };

  std::uint64_t number = 0;
  Kind kind = Kind::none;
  Eigen::VectorXd position, velocity, acceleration;  // Joint goal; the velocity also of a velocity request.
  std::vector<PoseRecord> poses;
  std::string frame;  // Frame of a twist.
  Vector6d twist = Vector6d::Zero();
  bool free_rotation = false;
  bool local = false, steer = false;
  Eigen::MatrixXd q;
  Eigen::VectorXd times;
};
void describe(auto& archive, Of<RequestRecord> auto& r) {
  archive(r.number, r.kind, r.position, r.velocity, r.acceleration, r.poses, r.frame, r.twist, r.free_rotation, r.local,
          r.steer, r.q, r.times);
}

/// The points of one set of a source, as files of 0.2 have them; in MCAP files see SetHistory.
struct ObstaclesRecord {
  std::uint64_t number = 0;
  Eigen::Matrix3Xd points, velocities;
  Eigen::VectorXd radii, uncertainty;
  std::vector<std::int32_t> order;  // see Obstacles::in_order
  std::vector<std::string> names;
  std::vector<std::int64_t> counts;
};
void describe(auto& archive, Of<ObstaclesRecord> auto& o) {
  archive(o.number, o.points, o.velocities, o.radii, o.uncertainty, o.order, o.names, o.counts);
}

/// One of the sources of a world; its points are those of the set of that number.
struct SourceRecord {
  std::string name;
  std::uint64_t id = 0, number = 0, heard_number = 0;
  double time = 0.0, heard = 0.0, valid_for = 0.0, moves_for = 0.0;
  bool emptied = false, repeated = false;
};
void describe(auto& archive, Of<SourceRecord> auto& s) {
  archive(s.name, s.id, s.number, s.heard_number, s.time, s.heard, s.valid_for, s.moves_for, s.emptied, s.repeated);
}
struct WorldRecord {
  std::uint64_t number = 0;
  std::vector<SourceRecord> sources;
};
void describe(auto& archive, Of<WorldRecord> auto& w) { archive(w.number, w.sources); }

struct ArmRecord {
  std::uint64_t number = 0, lifted_number = 0;  // 0: none is lifted
  std::string file, lifted_file;
  std::vector<std::int64_t> resting;  // coordinates, and the clearance from which on each is free [m]
  Eigen::VectorXd clearances;
  std::vector<std::string> attached;
};
void describe(auto& archive, Of<ArmRecord> auto& a) {
  archive(a.number, a.lifted_number, a.file, a.lifted_file, a.resting, a.clearances, a.attached);
}

/// One number among the settings; a part that may be left out is one of its own, 0 or 1.
struct SettingRecord {
  std::string name;
  double value = 0.0;
  std::uint64_t whole = 0;  // the same of a whole number
};
void describe(auto& archive, Of<SettingRecord> auto& s) { archive(s.name, s.value, s.whole); }

/// A field of a command: number, whole number, list of numbers or of limits.
enum class FieldKind : std::uint8_t { number, whole, numbers, limits };
struct FieldRecord {
  std::string name;
  FieldKind kind = FieldKind::number;
};
void describe(auto& archive, Of<FieldRecord> auto& f) { archive(f.name, f.kind); }

struct HeadRecord {
  std::uint32_t version = format;
  std::string sidestep_version, compiler, instruction_set;
  std::uint64_t arm_number = 0;
  std::string arm_file;
  std::vector<SettingRecord> settings;
  std::vector<FieldRecord> fields;
  bool whole = true;  // from the first step on, with all that a replay needs; else of a black box
};
void describe(auto& archive, Of<HeadRecord> auto& h) {
  archive(h.version, h.sidestep_version, h.compiler, h.instruction_set, h.arm_number, h.arm_file, h.settings, h.fields);
  if (h.version > step_file_format) {
    archive(h.whole);
  }
}

void describe(auto& archive, Of<TimedPath> auto& p) {
  archive(p.motion.period, p.motion.q, p.motion.v, p.motion.a, p.motion.station, p.places, p.place_station, p.clearance,
          p.limits.velocity, p.limits.acceleration, p.limits.jerk);
}

/// The inputs that a step begins with. Then follows what it took over, see TakenKind, the command, and (not in 0.2) where that begins.
struct StepInputs {
  std::uint64_t number = 0;
  double time = 0.0;  // that the step was told [s]; NaN: none
  Eigen::VectorXd q, v;
  bool dynamics = false;
  Eigen::MatrixXd mass_matrix;
  Eigen::VectorXd bias;
  std::uint64_t arm = 0, request = 0, obstacles = 0;       // numbers of what the step used
  std::uint64_t request_before = 0, obstacles_before = 0;  // and of what its arm was handed over with; 0: nothing
};
void read_step_inputs(Decoder& in, StepInputs& step);

/// What follows a step's content: where in it the command begins.
using CommandPlace = std::uint32_t;
/// The command of a step's content, not in 0.2. Throws std::invalid_argument.
std::span<const std::byte> command_of(std::span<const std::byte> step);

/// What of a step follows its inputs: one of these, then its content; `end` is the last. First come `elapsed` and `interval`.
enum class TakenKind : std::uint8_t {
  end,
  posture,
  activations,
  trajectory,
  answer,
  elapsed,
  look,
  restart,
  interval,
  pause,
  told
};

/// Writes the fields of a command one after the other. No allocation.
template <class Sink>
void write_command(Encoder<Sink>& out, const Command& command) noexcept {
  each_field(command, [&](const char*, const auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::is_enum_v<Value> || std::is_same_v<Value, bool>) {
      out(static_cast<std::int32_t>(value));
    } else {
      out(value);
    }
  });
}

std::vector<FieldRecord> fields_of_commands();

/// Reads commands that were recorded with these fields; a field that is none of them, or of another kind, is left out.
class CommandReader {
 public:
  explicit CommandReader(const std::vector<FieldRecord>& fields);
  /// What is left out keeps its value. Throws std::invalid_argument.
  void read(std::span<const std::byte> recorded, Command& command) const;
  /// The first field that differs; empty where none does. NaN is like NaN. Throws std::invalid_argument.
  std::optional<ReplayDifference> first_difference(std::span<const std::byte> recorded, const Command& replayed) const;

 private:
  struct Recorded {
    FieldKind kind;
    std::size_t field;  // Index among the fields of a command now; the number of these: none of them.
  };
  /// Each field of a command now as it was recorded; one that is left out is empty.
  std::vector<std::span<const std::byte>> split(std::span<const std::byte> recorded) const;

  std::size_t num_fields_ = 0;  // of a command now
  std::vector<Recorded> recorded_;
};

std::vector<SettingRecord> to_records(const ControllerSettings& settings);
/// Appends to `notes` what is not known, or not recorded.
ControllerSettings to_settings(const std::vector<SettingRecord>& records, std::vector<std::string>& notes);

/// Of this build.
const char* sidestep_version() noexcept;

std::string arm_bytes(const Arm& arm);
Arm arm_of(const std::string& bytes);

}  // namespace sidestep::recording
