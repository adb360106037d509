#pragma once

#include <atomic>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include "cycle_times.hpp"
#include "sidestep/controller/controller.hpp"
#include "sidestep/loop/cycle_observer.hpp"
#include "sidestep/loop/driver.hpp"
#include "sidestep/loop/loop_settings.hpp"
#include "sidestep/loop/run_report.hpp"
#include "sidestep/math/triple_buffer.hpp"

namespace sidestep {

/// What a loop does in each cycle, whichever thread runs it: read the state, step, write the command, judge whether the run goes on.
///
/// `check_before_motion`, `begin`, then `run` as long as it says so, then `end`: from one thread at a time. The controller is claimed by
/// who owns this, and all that is given outlives it.
class LoopCycle {
 public:
  LoopCycle(Controller& controller, Driver& driver, const LoopSettings& settings, std::vector<CycleObserver*> observers);

  /// Checks state and world; nothing is written. Throws std::runtime_error, see Loop::start.
  void check_before_motion();
  /// The driver takes control. Throws what it throws.
  void begin();
  /// One cycle; whether another follows.
  bool run() noexcept;
  /// The driver lets go of the arm.
  void end() noexcept;
  /// After `end`; without what is known of threads.
  RunReport report() const;

  // From any thread.
  /// See Loop::stop.
  void stop(RunEnd end, const std::string& why) noexcept;
  bool is_stopping() const noexcept { return end_.load(std::memory_order_acquire) != RunEnd::running; }
  /// When a cycle last began [s].
  double beat() const noexcept { return beat_.load(std::memory_order_relaxed); }
  /// The newest state; for one thread.
  const RobotState& state() noexcept { return shown_.get(); }
  /// Longest time for which a cycle waits for the robot [s].
  double longest_read() const noexcept;

 private:
  bool read(double began) noexcept;
  const Command& step(double began) noexcept;
  const Command& step_at_state() noexcept;
  bool write(const Command& command) noexcept;
  void observe(const Command& command) noexcept;
  void begin_to_stop(double now) noexcept;
  void judge(const Command& command, double now) noexcept;
  bool goes_on(const Command& command, double now) noexcept;
  /// A clock that has jumped ends the run: nobody knows how old states and obstacles are.
  void take_time(double now) noexcept;
  /// What `now` is on the clock by which a run is judged [s]: the machine's, or of a model the cycles so far.
  double clock(double now) const noexcept;
  double wait_for_turn() noexcept;
  void end_by(RunEnd end, const char* why) noexcept;
  void step_until_the_world_is_known();
  void read_first_state(double give_up);

  Controller& controller_;
  Driver& driver_;
  const LoopSettings settings_;
  const std::vector<CycleObserver*> observers_;
  const ControllerSettings::Output output_;
  const double period_;
  RobotState state_;
  TripleBuffer<RobotState> shown_;
  const Eigen::VectorXd unknown_;  // (nv) NaN
  CycleTimes times_;
  RunReport report_;
  std::atomic<RunEnd> end_{RunEnd::running};
  std::mutex words_;  // guards why_
  std::string why_;
  const char* own_why_ = "";  // of the loop's thread
  std::atomic<double> beat_{0.0};

  // Of the loop's thread [s].
  double due_ = 0.0, heard_ = 0.0, arrived_since_ = -1.0, stale_since_ = -1.0, ending_since_ = -1.0, resting_since_ = -1.0;
  double time_ = std::numeric_limits<double>::quiet_NaN();  // of the last state, on the clock of the run [s]
  double shift_ = 0.0;                            // of the robot's clock, so that time goes on from the run before [s]
  bool blind_ = false, cut_ = false;              // no state comes; the robot is not heard any more
  bool was_denied_ = false, was_paused_ = false;  // a command was not approved; before the end the controller was paused
};

}  // namespace sidestep
