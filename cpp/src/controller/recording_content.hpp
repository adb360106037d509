#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "recording_bytes.hpp"
#include "sidestep/controller/command.hpp"
#include "sidestep/controller/recording.hpp"
#include "sidestep/math/instruction_set.hpp"
#include "sidestep/planning/timed_path.hpp"

// What the chunks of a recording hold, see recording.hpp. Each `describe` serves both directions.
namespace sidestep::recording {

constexpr std::string_view magic{"\x89SSTEP\r\n", 8};  // not text; a transfer that changes line ends breaks it
constexpr std::uint32_t format = 2;
constexpr std::size_t tag_size = 4;
constexpr std::string_view head_tag = "HEAD", request_tag = "REQU", obstacles_tag = "OBST", world_tag = "WRLD",
                           arm_tag = "ARMS", step_tag = "STEP", done_tag = "DONE";

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

/// The points of one set of a source.
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
};
void describe(auto& archive, Of<HeadRecord> auto& h) {
  archive(h.version, h.sidestep_version, h.compiler, h.instruction_set, h.arm_number, h.arm_file, h.settings, h.fields);
}

void describe(auto& archive, Of<TimedPath> auto& p) {
  archive(p.motion.period, p.motion.q, p.motion.v, p.motion.a, p.motion.station, p.places, p.place_station, p.clearance,
          p.limits.velocity, p.limits.acceleration, p.limits.jerk);
}

/// What of a step follows its inputs: one of these, then its content; `end` is the last.
enum class TakenKind : std::uint8_t { end, posture, activations, trajectory, answer, elapsed, look, restart, interval };

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

/// The first field that differs, where `recorded` holds fields of these names; empty where none does. NaN is like NaN.
std::optional<ReplayDifference> first_difference(const std::vector<FieldRecord>& fields, std::span<const std::byte> recorded,
                                                 const Command& replayed);

std::vector<SettingRecord> to_records(const ControllerSettings& settings);
/// Appends to `notes` what is not known, or not recorded.
ControllerSettings to_settings(const std::vector<SettingRecord>& records, std::vector<std::string>& notes);

/// Of this build.
const char* sidestep_version() noexcept;

std::string arm_bytes(const Arm& arm);
Arm arm_of(const std::string& bytes);

/// A chunk as the file has it.
std::vector<std::byte> chunk(std::string_view tag, std::span<const std::byte> content);

}  // namespace sidestep::recording
