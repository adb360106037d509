#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/controller/command.hpp"
#include "sidestep/controller/recording.hpp"
#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// A recorded run as numbers over time: row k is step k. Units as in Command.
struct RecordedRun {
  explicit RecordedRun(RecordingHeader made_by)
      : header(std::move(made_by)), nv(static_cast<std::size_t>(header.arm.num_coordinates())) {}

  RecordingHeader header;
  bool complete = false;   ///< the recording was ended, not cut off
  std::uint64_t lost = 0;  ///< steps that were made and not recorded
  std::string damage;      ///< what is wrong with a file, the first, and where; empty: nothing
  std::size_t steps = 0, nv;

  std::vector<double> time;  ///< (steps) on the clock of `step` [s]
  /// (steps × nv), row by row: as measured, and as commanded.
  std::vector<double> q, v, position, velocity, acceleration, wanted, torque, torque_without_gravity;
  std::vector<Limit> limits;  ///< (steps × nv) limits that restrict each joint
  std::vector<SafetyStatus> status;
  std::vector<Activity> activity;
  std::vector<double> clearance, distance, speed, speed_limit, tracking_error;
  /// What the least clearance is of, and what changes the motion most: index in `parties`; -1: nothing is near, nothing does.
  std::vector<std::int32_t> nearest, bound_by;
  std::vector<std::int32_t> request;  ///< index in `requests`; -1: none is known

  /// A link, and what it is near to, in words, for example "link 'hand' and 'ball'".
  struct Parties {
    std::string link, words;
  };
  std::vector<Parties> parties;
  std::vector<std::string> requests;  ///< for example "a joint goal", in the order of use

  /// Clearance of each link to what is around, and of the arm to itself (the last), computed by the clearance query from the
  /// recorded q and from the recorded obstacles as they have moved until then; at some 1000 to 2000 moments. inf: farther than
  /// `largest_link_clearance`; NaN: the link is not there.
  static constexpr double largest_link_clearance = 0.5;  // [m]
  std::vector<std::string> links;
  std::vector<double> link_time;       ///< (moments) [s]
  std::vector<double> link_clearance;  ///< (moments × links), row by row [m]

  /// Obstacles where they were: balls.
  struct Scene {
    Eigen::Matrix3Xf points;  ///< [m]
    Eigen::VectorXf radii;    ///< [m]
  };
  std::vector<std::shared_ptr<const Scene>> scenes;  ///< (moments), where asked for; moments without a change share one

  /// One sentence from what was recorded: how safe step k was, and why.
  std::string explain(std::size_t k) const;
};

/// Reads a recording, or the files of one black box in the order of time. Throws std::system_error if one cannot be read,
/// std::invalid_argument that says what is wrong with it; Interruption. What follows a damage in a file is left out, and of a black box
/// the files after it are read. `scenes`: with these.
RecordedRun read_recorded_run(const std::vector<std::filesystem::path>& paths, bool scenes = false,
                              const Interrupted& interrupted = never_interrupted);

}  // namespace sidestep
