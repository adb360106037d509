#pragma once

// Libfranka without a robot: the names that the driver uses. The test gives the states and takes what is written.
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "active_control_base.h"
#include "exception.h"

namespace research_interface::robot {
struct Move {
  enum class ControllerMode { kJointImpedance, kCartesianImpedance, kExternalController };
};
}  // namespace research_interface::robot

namespace franka {

enum class RealtimeConfig { kEnforce, kIgnore };

/// What the test gives and takes.
struct Script {
  struct Next {
    RobotState state;
    std::uint64_t passed = 1;  // cycles
    bool waits = true;         // the state comes only now
  };
  struct Written {
    char kind;
    std::array<double, 7> values;
    bool finished;
  };
  RobotState idle;
  std::deque<Next> next;
  std::function<void()> fails;  // called by every read and write of a motion
  std::vector<Written> written;
  int stopped = 0, recovered = 0;
  double now = 0.0;  // [s]

  void write(char kind, const std::array<double, 7>& values, bool finished) {
    if (fails) {
      fails();
    }
    written.push_back({kind, values, finished});
  }
};
inline Script script;

class Control : public ActiveControlBase {
 public:
  std::pair<RobotState, Duration> readOnce() override {
    if (script.fails) {
      script.fails();
    }
    const Script::Next next = script.next.empty() ? Script::Next{script.idle} : script.next.front();
    if (!script.next.empty()) {
      script.next.pop_front();
    }
    script.now += next.waits ? 0.0005 : 0.0;
    return {next.state, Duration(next.passed)};
  }
  void writeOnce(const Torques& t) override { script.write('t', t.tau_J, t.motion_finished); }
  void writeOnce(const JointVelocities& v) override { script.write('v', v.dq, v.motion_finished); }
  void writeOnce(const JointPositions& p) override { script.write('p', p.q, p.motion_finished); }
};

class Robot {
 public:
  Robot(const std::string& address, RealtimeConfig) {
    if (address != "robot") {
      throw NetworkException("no robot at " + address);
    }
  }
  RobotState readOnce() { return script.idle; }
  std::unique_ptr<ActiveControlBase> startTorqueControl() { return std::make_unique<Control>(); }
  std::unique_ptr<ActiveControlBase> startJointVelocityControl(const research_interface::robot::Move::ControllerMode&) {
    return std::make_unique<Control>();
  }
  std::unique_ptr<ActiveControlBase> startJointPositionControl(const research_interface::robot::Move::ControllerMode&) {
    return std::make_unique<Control>();
  }
  void stop() { ++script.stopped; }
  void automaticErrorRecovery() { ++script.recovered; }
};

}  // namespace franka
