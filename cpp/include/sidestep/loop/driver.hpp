#pragma once

#include <string>
#include <vector>

#include "sidestep/controller/command.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/loop/robot_state.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// What a driver says of its robot, once.
struct RobotDescription {
  std::string name;
  std::vector<std::string> joints;  ///< (nv) names in the order of its state; empty: it does not say, and nothing is compared
  JointLimits limits = {};          ///< of the robot; members that are empty are not compared
  std::vector<ControllerSettings::Output> outputs;  ///< what it takes
  double period = 0.001;                            ///< of its cycle [s]
  bool paced = true;                     ///< `read` waits for the robot's cycle; false: the loop's own clock is the pace
  bool real_time = true;                 ///< false: a model on its own clock, which the loop drives as fast as it can
  std::string when_silent = "not told";  ///< what it does when nobody writes, in words

  /// Throws std::invalid_argument that names the value and what is allowed.
  void validate() const;
};

/// How reading or writing ended.
enum class DriverResult {
  ok,
  waiting,  ///< there was no new state within the time
  lost,     ///< the connection is gone
  stopped,  ///< the robot has stopped itself: a reflex, a protective stop
};

/// Connects a controller to one kind of robot. All calls come from one thread at a time.
class Driver {
 public:
  virtual ~Driver() = default;

  virtual const RobotDescription& description() const noexcept = 0;
  /// Begins to control the robot. Throws std::runtime_error that says why it cannot.
  virtual void start(ControllerSettings::Output output) = 0;
  /// Writes the robot's next state into `state`; also before `start`. Waits at most `timeout` [s].
  virtual DriverResult read(RobotState& state, double timeout) noexcept = 0;
  /// Sends a command. A driver that sends positions is not called with one that is NaN.
  virtual DriverResult write(const Command& command) noexcept = 0;
  /// Ends the control: the robot holds its position. May be called again, and after a loss.
  virtual void stop() noexcept = 0;
  /// Why the last call ended as `lost` or `stopped`, in words. For another thread too, once the loop has ended.
  virtual std::string trouble() const = 0;
};

/// Short names, for example "position".
const char* to_string(ControllerSettings::Output output) noexcept;

}  // namespace sidestep
