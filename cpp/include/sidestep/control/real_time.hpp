#pragma once

#include <Eigen/Core>
#include <atomic>
#include <thread>

#include "sidestep/control/handover.hpp"
#include "sidestep/control/loop.hpp"

namespace sidestep {

struct RealTimeSettings {
  double period = 0.001;  ///< [s]
  int steps = 10000;
  bool priority = true;  ///< ask for real-time scheduling (SCHED_FIFO), where the machine allows it

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

/// When the steps of a run began and ended.
struct RealTimeRecord {
  Eigen::VectorXd late;   ///< (steps done) [s] from when a step was due to when it began
  Eigen::VectorXd taken;  ///< (steps done) [s] from when it began to when its torque was there
  int missed = 0;         ///< steps that ended after the next one was due
  bool prioritised = false;
};

struct ArmState {
  Eigen::VectorXd q, v;
};

/// A Loop at its period by the machine's clock, in a thread of its own: step k is due at (k + 1) periods after the start,
/// and what is late is not left out. The arm is integrated with the acceleration that was commanded; mass matrix and bias
/// stay as they are given, as an arm's own interface would give them. Meanwhile other threads may set the loop's goal and
/// obstacles.
class RealTimeRun {
 public:
  /// Starts. Throws std::invalid_argument on wrong sizes, values that are not finite and settings at fault, and
  /// std::runtime_error if the loop is in use. It is used by this run alone until the run has ended.
  RealTimeRun(Loop& loop, ArmState start, Eigen::MatrixXd mass_matrix, Eigen::VectorXd bias, RealTimeSettings settings = {});
  /// Stops, and waits for the step at hand.
  ~RealTimeRun();
  RealTimeRun(const RealTimeRun&) = delete;
  RealTimeRun& operator=(const RealTimeRun&) = delete;

  /// Asks for the end after the step at hand; waits for nothing.
  void stop() noexcept { stop_.store(true, std::memory_order_relaxed); }
  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// The state before the next step; for one thread.
  const ArmState& state() noexcept { return state_.get(); }
  /// Waits for the end.
  const RealTimeRecord& finish();

 private:
  void run() noexcept;

  Loop& loop_;
  Loop::Use use_;
  RealTimeSettings settings_;
  Eigen::MatrixXd mass_matrix_;
  Eigen::VectorXd bias_;
  ArmState now_;
  Handover<ArmState> state_;
  RealTimeRecord record_;
  std::atomic<bool> running_{true}, stop_{false};
  std::thread thread_;
};

}  // namespace sidestep
