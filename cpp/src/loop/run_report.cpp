#include "sidestep/loop/run_report.hpp"

namespace sidestep {

const char* to_string(RunEnd end) noexcept {
  switch (end) {
    case RunEnd::running: return "running";
    case RunEnd::arrived: return "arrived";
    case RunEnd::duration: return "duration";
    case RunEnd::stopped: return "stopped";
    case RunEnd::interrupted: return "interrupted";
    case RunEnd::failed: return "failed";
    case RunEnd::state_lost: return "state_lost";
    case RunEnd::robot_stopped: return "robot_stopped";
    case RunEnd::late: return "late";
    case RunEnd::source_silent: return "source_silent";
    case RunEnd::denied: break;
  }
  return "denied";
}

}  // namespace sidestep
