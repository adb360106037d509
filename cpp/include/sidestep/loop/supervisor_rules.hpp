#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sidestep/math/fields.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// How far a supervisor lets things go. Units and meaning of each number: `fields<SupervisorSettings>()`.
struct SupervisorSettings {
  double tolerance = 0.1, position_tolerance = 0.02, tracking_tolerance = 0.3;
  double state_age = 0.05, blind_time = 1.5, command_age = 0.02, approval_age = 0.02, stale_time = 1.0, rest_speed = 0.05;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

template <> const std::vector<Field<SupervisorSettings>>& fields();

/// What a loop reports of a cycle before it writes its command. Of a fixed size: it is in memory that two processes share.
struct CycleReport {
  static constexpr int most_joints = 64;
  using Numbers = std::array<double, most_joints>;

  std::uint64_t cycle = 0;  ///< from 1
  double now = 0.0;         ///< when it was reported, on the machine's monotonic clock [s]
  double state_age = 0.0;   ///< age of the measured state; NaN: the robot does not say [s]
  bool stale = false;       ///< the controller holds its obstacles for too old
  bool is_blind = false;    ///< no new state came: q and v are the last ones
  bool is_over = false;     ///< the run has ended: nothing is written any more, and silence is none
  bool writes_torque = false, writes_position = false;
  Numbers q{}, v{}, position{}, velocity{}, torque{};
};

/// Why a supervisor does not approve.
enum class Denial : std::int32_t {
  none,
  unknown,            ///< nothing was judged yet
  not_finite,         ///< a number is not finite
  position,           ///< a measured or commanded position is outside its limits
  velocity,           ///< a measured or commanded velocity is above its limit
  torque,             ///< a commanded torque is above its limit
  torque_rate,        ///< commanded torques change faster than their limit
  tracking,           ///< a commanded position is far from where the arm is
  old_state,          ///< the state is too old, or none has come for too long
  silent_loop,        ///< the loop has not reported for too long
  moves_blindly,      ///< the arm moves although its obstacles have been too old for a while
  silent_supervisor,  ///< of the loop's side: the supervisor does not answer
};

/// What a supervisor says of a cycle.
struct Verdict {
  std::uint64_t cycle = 0;  ///< that was judged last
  double now = 0.0;         ///< when, on the machine's monotonic clock [s]
  Denial denial = Denial::unknown;
  std::int32_t joint = -1;  ///< -1: none
  double value = 0.0, limit = 0.0;

  bool approves() const noexcept { return denial == Denial::none; }
  /// One sentence. `joints`: names.
  std::string words(const std::vector<std::string>& joints) const;
};

/// Limits that every command and every state must keep, apart from the controller that made them.
class SupervisorRules {
 public:
  /// Throws std::invalid_argument where an arm has more joints than `most_joints`.
  SupervisorRules(const JointLimits& limits, double period, const SupervisorSettings& settings = {});

  /// Judges a cycle. Once it has denied, it denies until `reset`: what happened is not forgotten. Between two runs nothing is judged.
  const Verdict& judge(const CycleReport& report) noexcept;
  /// Nobody has reported since the last call; `now`: of the machine's monotonic clock [s].
  const Verdict& wait(double now) noexcept;
  void reset() noexcept;
  int num_joints() const noexcept { return static_cast<int>(limits_.lower.size()); }

 private:
  Verdict first_fault(const CycleReport& report) const noexcept;
  bool is_outside(const CycleReport& report, int joint, Verdict& found) const noexcept;

  JointLimits limits_;
  double period_;
  SupervisorSettings settings_;
  Verdict verdict_;
  CycleReport last_;
  double stale_since_ = -1.0, blind_since_ = -1.0;  // [s]; -1: neither
};

}  // namespace sidestep
