#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "sidestep/controller/command.hpp"

namespace sidestep {

/// Why a run ended.
enum class RunEnd {
  running,        ///< it has not ended
  arrived,        ///< the arm has been at its goal for LoopSettings::hold
  duration,       ///< its time was over
  stopped,        ///< somebody asked for it
  interrupted,    ///< Ctrl-C
  failed,         ///< an exception of the program around it
  state_lost,     ///< no new state came for LoopSettings::state_timeout, their clock has jumped, or the connection is gone
  robot_stopped,  ///< the robot has stopped itself
  late,           ///< the loop was later than LoopSettings::longest_gap
  source_silent,  ///< a source of obstacles was overdue for LoopSettings::silent_timeout
  denied,         ///< an observer did not approve of a command: it was not written
};

/// Short names, for example "state_lost".
const char* to_string(RunEnd end) noexcept;

/// What a run was.
struct RunReport {
  RunEnd end = RunEnd::running;
  std::string why;         ///< in words
  std::string at_the_end;  ///< what the controller said last, see Controller::explain
  std::uint64_t cycles = 0;
  std::uint64_t missed = 0;               ///< cycles that ended after the next one was due
  std::uint64_t lost = 0;                 ///< cycles in which the robot went on without a command
  std::uint64_t unwritten = 0;            ///< commands that were not written: without a position, or not approved
  SafetyStatus worst = SafetyStatus::ok;  ///< most severe status of a command
  double stop_time = 0.0;                 ///< from the reason to the end until the loop let go of the arm [s]
  bool at_rest = false;                   ///< the arm was at rest, as measured, when the loop let go of it
  std::string scheduling;                 ///< what the machine permitted, in words: "SCHED_FIFO 60, memory locked"
  bool prioritised = false;               ///< real-time scheduling was permitted
  Eigen::VectorXd late;   ///< (last cycles) from when a cycle was due until it began [s]; 0 where the robot is the pace
  Eigen::VectorXd taken;  ///< (last cycles) from the state until the command was written [s]

  /// The arm did what it was to do, and nothing ended the run before.
  bool is_success() const noexcept { return end == RunEnd::arrived || end == RunEnd::duration || end == RunEnd::stopped; }
};

}  // namespace sidestep
