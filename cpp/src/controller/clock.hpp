#pragma once

#include <array>
#include <chrono>
#include <string>

#include "tick.hpp"

namespace sidestep {

/// The controller's own monotonic clock: makes a Tick of the time that a step is told, or of the machine's clock.
///
///   - Told: the difference to the last told time elapsed, in synchronous runs too.
///   - Not told, synchronous: exactly a period of the settings, so that runs repeat bit for bit.
///   - Not told: the machine's clock. What is shorter than a period counts as one, since a loop faster than real time is a simulation.
class Clock {
 public:
  /// period: of the settings [s].
  Clock(double period, bool synchronous) noexcept;

  /// By the machine's clock: time since the last step began and since it ended, and now [s]; NaN: unknown.
  struct Machine {
    double since_begin = std::numeric_limits<double>::quiet_NaN(), since_end = since_begin, now = since_begin;
  };

  /// The next step begins; `time`: on the caller's clock [s], not finite: not told. Reads the machine's clock.
  const Tick& begin_step(double time) noexcept;
  /// The step ends: a pause begins here, however long the step has planned.
  void end_step() noexcept { ended_ = std::chrono::steady_clock::now(); }
  /// The same from what the machine's clock says.
  const Tick& advance(double time, const Machine& machine) noexcept;

  const Tick& tick() const noexcept { return tick_; }
  /// What the machine's clock said in this step: an input, which recordings keep.
  const Machine& machine() const noexcept { return machine_; }
  /// The next step takes this in place of the machine's clock.
  void give(const Machine& machine) noexcept {
    machine_ = machine;
    given_ = true;
  }
  /// What is wrong with the time of this step, in words; empty: nothing.
  std::string explain() const;

 private:
  double since_told(double time) noexcept;
  double since_machine(double since_begin) noexcept;
  /// How long the reference counts the last command as held.
  double held() noexcept;
  double next_period() noexcept;
  void count(double elapsed) noexcept;

  static constexpr int num_recent = 5;

  double period_, longest_gap_;
  bool synchronous_;
  Tick tick_;
  Machine machine_;
  bool given_ = false, has_begun_ = false;
  std::chrono::steady_clock::time_point begun_{}, ended_{};
  double anchor_ = 0.0;       // own time after which only whole periods have elapsed, so that rounding does not add up
  double periods_ = 0.0;      // periods since
  double last_time_ = 0.0;    // as told last
  bool has_told_ = false;     // some step was told its time
  bool told_before_ = false;  // the last step was
  double lead_ = 0.0;         // by which steps came early, at most half a period: the next may be late by as much
  double slip_ = 0.0;         // time that the reference has not counted yet
  std::array<double, num_recent> recent_;  // last elapsed times without gaps
  int next_ = 0;
};

}  // namespace sidestep
