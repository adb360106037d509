#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <thread>

#include "sidestep/math/triple_buffer.hpp"
#include "sidestep/controller/controller.hpp"

namespace sidestep {

struct RealTimeSettings {
  static constexpr std::int64_t most_steps = 100'000'000;  ///< a day at 1 kHz, of which the record takes 1.6 GB

  std::int64_t steps = 10000;
  bool priority = true;  ///< ask for real-time scheduling (SCHED_FIFO), where the machine allows it

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

/// When the steps of a run began and ended.
struct RealTimeRecord {
  Eigen::VectorXd late;   ///< (steps done) [s] from when a step was due to when it began
  Eigen::VectorXd taken;  ///< (steps done) [s] from when it began to when its command was there
  int missed = 0;         ///< steps that ended after the next one was due
  bool prioritised = false;
};

struct ArmState {
  Eigen::VectorXd q, v;
};

/// Runs a Controller at its period by the machine's clock, in its own thread. Step k is due at (k + 1) periods after the
/// start; late steps are not skipped. A perfect model replaces the arm: v ← v + a T, q ← q + v T. Meanwhile other threads
/// may set the controller's goal and obstacles.
class RealTimeRun {
 public:
  /// Starts. Throws std::invalid_argument on wrong sizes, values that are not finite and wrong settings, and
  /// std::runtime_error if the controller is in use. The run reserves the controller until it has ended.
  RealTimeRun(Controller& controller, ArmState start, RealTimeSettings settings = {});
  /// Stops, and waits for the present step.
  ~RealTimeRun();
  RealTimeRun(const RealTimeRun&) = delete;
  RealTimeRun& operator=(const RealTimeRun&) = delete;

  /// Ends the run after the present step; does not wait.
  void stop() noexcept { stop_.store(true, std::memory_order_relaxed); }
  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// The state before the next step; for one thread.
  const ArmState& state() noexcept { return state_.get(); }
  /// Waits for the end.
  const RealTimeRecord& finish();

 private:
  void run() noexcept;

  Controller& controller_;
  Controller::ClaimedController use_;
  RealTimeSettings settings_;
  ArmState now_;
  TripleBuffer<ArmState> state_;
  RealTimeRecord record_;
  std::atomic<bool> running_{true}, stop_{false};
  std::thread thread_;
};

}  // namespace sidestep
