#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sidestep/controller/settings.hpp"
#include "sidestep/math/interruption.hpp"
#include "sidestep/arm/arm.hpp"

namespace sidestep {

// Recordings of a controller: what every step was given, what it took over from other threads, and its command, in one file, from
// which a replay gives the same commands bit for bit. Of one machine: another processor or compiler rounds otherwise.
//
// The file, little endian: magic (8 bytes), then chunks, each a tag (4 bytes), the size of its content (u64), the content and its
// CRC-32 (u32, that of zlib). A program that is killed leaves whole chunks, perhaps part of a last one.
//   HEAD  format version (u32), Sidestep's version, compiler, instruction set, arm (as an .arm file), settings by name, fields of a
//         command by name
//   REQU  a goal, velocity, twist or trajectory as it was set, with its number; OBST the same of obstacles
//   ARMS  an arm that was set, or that holds other objects, with its number
//   STEP  q, v, mass matrix and bias where given; the numbers of the request, obstacles and arm in use; of a controller that is not
//         `synchronous` what the step took over: posture, activation distances, trajectory out of the way, path; the command
//   DONE  steps and lost steps, where the recording was ended
// A `synchronous` controller finds these results within the step, so they are found again and not recorded.

/// What a recording holds.
struct RecordingSummary {
  std::filesystem::path path;
  std::uint64_t steps = 0;  ///< recorded
  std::uint64_t lost = 0;   ///< made after those, when the disk was too slow: not recorded
  std::uint64_t bytes = 0;  ///< of the file
};

/// What made a recording, and with what.
struct RecordingHeader {
  std::uint32_t format = 0;
  std::string sidestep_version, compiler, instruction_set;
  Arm arm;
  ControllerSettings settings;
  /// What this Sidestep does not know of the recording, or the recording not of this Sidestep: settings and fields of a command.
  std::vector<std::string> notes;
};

/// The first field of a command that a replay gave differently.
struct ReplayDifference {
  std::uint64_t step = 0;          ///< from 1
  std::string field;               ///< for example "torque[3]"
  std::string recorded, replayed;  ///< its values, doubles with 17 digits
};

/// What a replay found.
struct ReplayResult {
  std::uint64_t steps = 0;                     ///< replayed, the one that differs included
  std::optional<ReplayDifference> difference;  ///< the first; the replay ends there
  std::string damage;                          ///< what is wrong with the file, and where; empty: nothing
  bool complete = false;                       ///< the recording was ended, not cut off
  std::uint64_t lost = 0;                      ///< steps that were made and not recorded
  std::vector<std::string> notes;              ///< what differs between recording and replay beside the commands
  std::string arm;                             ///< its name
  double seconds = 0.0;                        ///< of recorded motion

  /// Every command that was recorded is the same bit for bit (NaN like NaN), and the file is not damaged.
  bool equal() const noexcept { return !difference && damage.empty(); }
};

/// Throws std::system_error if the file cannot be read, std::invalid_argument that says what is wrong with it.
RecordingHeader read_recording_header(const std::filesystem::path& path);

/// Gives a controller what a recording holds, step by step, without threads of its own, and compares the commands. With an arm or
/// settings, the replay uses these and its notes name what differs. Throws as `read_recording_header` does, Interruption.
ReplayResult replay(const std::filesystem::path& path, const std::optional<Arm>& arm = std::nullopt,
                    const std::optional<ControllerSettings>& settings = std::nullopt,
                    const Interrupted& interrupted = never_interrupted);

/// The path of a new recording in the folder that the environment variable SIDESTEP_RECORD names: every controller that the
/// program makes is recorded there. Empty where it is not set. Throws std::system_error where the folder cannot be made.
std::filesystem::path next_of_folder(const std::string& name);

}  // namespace sidestep
