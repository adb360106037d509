#pragma once

#include <limits>

namespace sidestep {

/// Detects that a motion has made no progress towards its goal for a while, also if the arm creeps or goes in circles.
///
/// Progress means that the potential U falls below its smallest value so far by a fraction; the error goes with √U.
class ProgressMonitor {
 public:
  /// patience [s], positive; fraction in (0, 1). Throws std::invalid_argument.
  explicit ProgressMonitor(double patience = 2.0, double fraction = 0.02);

  /// Takes the potential of the goal at a time [s], which never decreases. Returns whether patience has run out.
  bool update(double time, double potential) noexcept { return note(time, potential, (1.0 - fraction_) * least_); }

  /// The same for a distance left, which must fall by a fixed `step`.
  bool update_way(double time, double way, double step) noexcept { return note(time, way, least_ - step); }

  /// Starts anew, for a new goal.
  void reset() noexcept {
    least_ = std::numeric_limits<double>::infinity();
    since_ = std::numeric_limits<double>::infinity();
  }

 private:
  bool note(double time, double value, double below) noexcept {
    if (value < below) {
      since_ = time;
      least_ = value;
    }
    return time - since_ >= patience_;
  }

  double patience_, fraction_;
  double least_ = std::numeric_limits<double>::infinity();
  double since_ = std::numeric_limits<double>::infinity();
};

}  // namespace sidestep
