#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sidestep/controller/settings.hpp"
#include "sidestep/math/interruption.hpp"
#include "sidestep/arm/arm.hpp"

namespace sidestep {

// Recordings of a controller: what every step was given, what it took over from other threads, and its command, in one file, from
// which a replay gives the same commands bit for bit. Of one machine: another processor or compiler rounds otherwise.
//
// The file is MCAP (mcap.dev/spec), without chunks and index, so that a program that is killed leaves whole records, perhaps part of a
// last one. One channel for each kind of record, with the message encoding "sidestep": numbers little endian, then the CRC-32 of all
// that (u32, that of zlib). The time of a message is that of its step [ns].
//   /sidestep/head       format version (u32), Sidestep's version, compiler, instruction set, arm (as an .arm file), settings by name,
//                        fields of a command by name, whether it is whole
//   /sidestep/request    a goal, velocity, twist or trajectory as it was set, with its number
//   /sidestep/obstacles  the same of one set of a source of obstacles; /sidestep/world: the sets of all sources
//   /sidestep/arm        an arm that was set, or that holds other objects, with its number
//   /sidestep/step       q, v, mass matrix and bias where given; the numbers of the request, obstacles and arm in use; of a controller
//                        that is not `synchronous` what the step took over: posture, activation distances, trajectory out of the way,
//                        path; the command, and where it begins
//   /sidestep/done       steps and lost steps, where the recording was ended
//   /summary             JSON, at most 50 times a second, for other programs
// A `synchronous` controller finds these results within the step, so they are found again and not recorded. The files of a black box
// begin in the middle and have no results of other threads: they are read, see recorded_run.hpp, and not replayed.

/// End of the names of recordings.
inline constexpr std::string_view recording_suffix = ".mcap";
/// Beginning of the names of the files of black boxes; of others in their folder none is ever deleted.
inline constexpr std::string_view black_box_begin = "blackbox-";

/// What a recording holds.
struct RecordingSummary {
  std::filesystem::path path;
  std::uint64_t steps = 0;  ///< recorded
  std::uint64_t lost = 0;   ///< made after those, when the disk was too slow: not recorded
  std::uint64_t bytes = 0;  ///< of the file
};

/// What a black box has kept.
struct BlackBoxSummary {
  std::vector<std::filesystem::path> files;  ///< in the order of time; older ones are deleted
  std::uint64_t steps = 0;                   ///< recorded, those in deleted files included
  std::uint64_t lost = 0;                    ///< made after those: the disk was too slow or full
  std::uint64_t bytes = 0;                   ///< of the files
  std::string trouble;                       ///< why nothing was written any more; empty: nothing
};
/// Size near which all black boxes in a folder are kept [B].
inline constexpr std::uint64_t black_box_bytes = std::uint64_t{1} << 30;

/// What made a recording, and with what.
struct RecordingHeader {
  std::uint32_t format = 0;
  std::string sidestep_version, compiler, instruction_set;
  bool whole = true;  ///< from the first step on; else of a black box
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
/// settings, the replay uses these and its notes name what differs. Reads recordings of Sidestep 0.2 (`.step`) too. Throws as
/// `read_recording_header` does, also for a black box; Interruption.
ReplayResult replay(const std::filesystem::path& path, const std::optional<Arm>& arm = std::nullopt,
                    const std::optional<ControllerSettings>& settings = std::nullopt,
                    const Interrupted& interrupted = never_interrupted);

/// The path of a new recording in the folder that the environment variable SIDESTEP_RECORD names: every controller that the
/// program makes is recorded there. Empty where it is not set. Throws std::system_error where the folder cannot be made.
std::filesystem::path next_of_folder(const std::string& name);

}  // namespace sidestep
