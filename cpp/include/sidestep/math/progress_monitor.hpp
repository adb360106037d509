#pragma once

#include <limits>

namespace sidestep {

/// Says when a motion has come no nearer to its goal for a while: the judgement over time that one step cannot give,
/// for arms that creep or go in circles.
///
/// Progress is a potential U that falls below the least one so far by a fraction; the error goes with √U.
class ProgressMonitor {
 public:
  /// patience [s], positive; fraction in (0, 1). Throws std::invalid_argument.
  explicit ProgressMonitor(double patience = 2.0, double fraction = 0.02);

  /// Takes the potential of the goal at a time [s] that does not go back; whether patience has run out.
  bool update(double time, double potential) noexcept { return note(time, potential, (1.0 - fraction_) * least_); }

  /// The same of a way that is left, which is to fall by a `step` of its unit, whatever is left.
  bool update_way(double time, double way, double step) noexcept { return note(time, way, least_ - step); }

  /// For a new goal.
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
