#pragma once

#include <string>

#include "sidestep/controller/command.hpp"
#include "sidestep/loop/robot_state.hpp"

namespace sidestep {

/// Takes part in every cycle of a Loop, in its thread: a server, a supervisor, a log. Allocates nothing, and waits for no other thread longer
/// than its documentation says.
class CycleObserver {
 public:
  virtual ~CycleObserver() = default;
  /// The state of this cycle and its command, before it is written. `now`: of the machine's monotonic clock [s].
  virtual void observe(const RobotState& state, const Command& command, double now) noexcept = 0;
  /// The state before the first motion, with a command that is not written; in the thread of Loop::start.
  virtual void observe_before_motion(const RobotState&, const Command&, double) noexcept {}
  /// Whether the command of this cycle may be written. One refusal ends the run.
  virtual bool approves() noexcept { return true; }
  /// The run is over: no cycle follows before the next one begins.
  virtual void end() noexcept {}
  /// Why it did not approve, in words; after the run.
  virtual std::string why() const { return {}; }
};

}  // namespace sidestep
