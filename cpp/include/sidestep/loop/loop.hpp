#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "sidestep/controller/controller.hpp"
#include "sidestep/loop/cycle_observer.hpp"
#include "sidestep/loop/driver.hpp"
#include "sidestep/loop/loop_settings.hpp"
#include "sidestep/loop/run_report.hpp"

namespace sidestep {

class LoopCycle;

/// Runs a Controller on a robot: one real-time thread that reads the state, steps and writes the command, once a period.
///
/// Before the first motion it checks that the controller fits the robot (joints, limits, period, output), that the state is plausible
/// and free, and that obstacles are known. However a run ends, there is one way to stop: the controller is paused, which brings the arm to
/// rest within its limits and clearances; then the driver stops. Where no state comes, the arm is braked without one; where the robot
/// is not heard any more, the driver stops at once. The goal is kept, so that another run goes on.
///
/// Meanwhile other threads may set goals and obstacles.
class Loop {
 public:
  /// Checks that the controller fits the robot. Throws std::invalid_argument that names what does not fit, and std::runtime_error if the
  /// controller is in use. All that is given must outlive this.
  Loop(Controller& controller, Driver& driver, const LoopSettings& settings = {}, std::vector<CycleObserver*> observers = {});
  /// Stops, and waits for the end.
  ~Loop();
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  /// Checks state and world, and begins. Waits for both for LoopSettings::start_timeout. Throws std::runtime_error that says what is
  /// wrong and what to do; then nothing was written to the robot.
  void start();
  /// Ends the run: brings the arm to rest first. Does not wait; the first reason counts.
  void stop(RunEnd end = RunEnd::stopped, const std::string& why = {}) noexcept;
  bool is_running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// Whether the arm is being brought to rest.
  bool is_stopping() const noexcept;
  /// The newest state; for one thread.
  const RobotState& state() noexcept;
  /// Waits for the end, and leaves the controller to others; also of a run that did not start.
  const RunReport& finish();

 private:
  void run() noexcept;
  void watch() noexcept;

  const LoopSettings settings_;
  Controller::ClaimedController use_;
  const std::unique_ptr<LoopCycle> cycle_;
  RunReport report_;
  std::string scheduling_;    // of the loop's thread, for the report
  bool prioritised_ = false;  // the same
  bool locked_ = false;
  std::atomic<bool> running_{false}, started_{false};
  std::thread thread_, watchdog_;
};

/// The output of a controller, where that was left open.
ControllerSettings::Output output_of(const Controller& controller) noexcept;

}  // namespace sidestep
