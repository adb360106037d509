#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidestep {

/// The moment of a step: all that a stage knows of time. Times in seconds, on the controller's own clock, which never goes back.
struct Tick {
  double time = 0.0;      ///< now
  double elapsed = 0.0;   ///< since the last step
  double moved = 0.0;     ///< the same, for what the last command moved: a gap counts as the period that was expected
  double held = 0.0;      ///< the same, as the reference counts it: jitter below half a period counts as none
  double expected = 0.0;  ///< period for which the last step commanded
  double period = 0.0;    ///< Period for which this step commands: how soon the next step is expected.
  double told = 0.0;      ///< period of the settings
  bool gap = false;       ///< no loop is as late as this step
  bool pauses = false;    ///< the same, or by the machine's clock where the time was not told
  /// By how much the time that was told went back; 0: it stands still; NaN: it goes on.
  double back = std::numeric_limits<double>::quiet_NaN();
  double offset = 0.0;  ///< own time less the caller's
  int late = 0;         ///< steps so far that came later than one and a half periods of the settings after the one before
  int missed = 0;       ///< periods of the settings so far in which a step was missing
  /// Share of the expected periods, lately, in which a step was missing: of a connection that loses messages, not of a loop that is slow.
  double missed_share = 0.0;

  /// A stamp of the caller's clock on the controller's own: of the clock that steps are told; before any was, of the machine's
  /// (std::chrono::steady_clock, in Python time.monotonic), in a synchronous run of the controller's own.
  double own_time(double stamp) const noexcept { return stamp + offset; }
  bool goes_on() const noexcept { return std::isnan(back); }
  /// The last command was held as long as the last step expected.
  bool is_as_expected() const noexcept { return held == expected; }
  /// Time for whose change of torque a step may make up: a drive judges each of its own periods, however rarely it is told.
  double torque_period() const noexcept { return std::min(elapsed, told); }

  /// How much is missing, from 0, a share that costs nothing, to 1.
  double missing() const noexcept {
    constexpr double few = 0.02, many = 0.1;
    return std::clamp((missed_share - few) / (many - few), 0.0, 1.0);
  }
  /// Share of its speed for an arm whose torques change at a limited rate. Gravity and inertia ask for less of it in slower motions, and
  /// a loop below half of the told rate leaves them too little. Where steps are missing, torques do not arrive: what they would have braked
  /// is made up for at that rate, and meanwhile a joint goes on beyond a limit that it was to keep.
  double speed_share() const noexcept {
    constexpr double usual_share = 0.5, for_missing = 0.2;
    return std::min(1.0, told / (period * usual_share)) * (1.0 - for_missing * missing());
  }
  /// Way that such an arm stays away from position limits, beside the margin of the settings: as time at the velocity limit [s].
  double inside() const noexcept {
    constexpr double for_missing = 0.8e-3;
    return for_missing * missing();
  }
  /// Time by which a reference whose velocities are held for the period leads an arm that moves on in periods of the settings.
  double lead() const noexcept { return 0.5 * (period - told); }

  /// The moment of a loop that is never late.
  static Tick regular(double period, double time = 0.0) noexcept {
    return {time, period, period, period, period, period, period};
  }
};

}  // namespace sidestep
