#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sidestep/controller/settings.hpp"
#include "sidestep/loop/cycle_observer.hpp"
#include "sidestep/loop/supervisor_rules.hpp"

namespace sidestep {

struct SupervisedMemory;

/// The loop's side of a supervisor: reports each cycle in memory that two processes share, and approves only what the other process has
/// approved. Waits for its answer for 0.3 ms at most; after that the last approval counts while it is not older than
/// SupervisorSettings::approval_age. Denies by default: where nobody answers, nothing is written.
class SupervisorLink final : public CycleObserver {
 public:
  /// Makes the memory, of a name of its own, in which `supervise` finds limits and settings. Throws std::invalid_argument for too many
  /// joints, std::system_error where the machine has no such memory.
  SupervisorLink(const Robot& arm, ControllerSettings::Output output, double period, const SupervisorSettings& settings = {});
  ~SupervisorLink() override;

  /// The file of the shared memory, for `supervise`.
  const std::string& path() const noexcept { return path_; }
  /// Waits until the other process answers; false: it did not within the time [s].
  bool wait_for_supervisor(double timeout) const noexcept;
  void observe(const RobotState& state, const Command& command, double now) noexcept override;
  bool approves() noexcept override;
  void end() noexcept override;
  std::string why() const override;
  /// What it said last.
  Verdict verdict() const noexcept;
  /// What was denied may be tried again, with the next cycle.
  void reset() noexcept;

 private:
  /// Age of a state whose clock may have an offset, as far as it is older than the freshest of late [s].
  double state_age(double now, double measured) noexcept;

  std::string path_;
  std::vector<std::string> joints_;
  SupervisorSettings settings_;
  std::unique_ptr<SupervisedMemory, void (*)(SupervisedMemory*)> memory_;
  bool writes_torque_, writes_position_;
  std::uint64_t cycle_ = 0;
  Verdict last_;
  double least_behind_ = std::numeric_limits<double>::quiet_NaN(), last_now_ = 0.0;  // [s]
};

/// The other process: judges what the loop reports, by SupervisorRules, until `ends` says so or the loop's process is gone. Throws
/// std::system_error where there is no such memory, std::runtime_error where it is of another version.
void supervise(const std::string& path, const std::function<bool()>& ends);

}  // namespace sidestep
