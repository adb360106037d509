#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sidestep/clearance/clearance_field.hpp"
#include "sidestep/clearance/clearances.hpp"
#include "sidestep/body/body.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "world.hpp"

namespace sidestep {

/// Closing speeds of obstacles whose velocity nobody told, found from one set of obstacles to the next.
///
/// When a set replaces another, the clearances h_k of the body's ellipsoids are evaluated at one and the same configuration, in the
/// old set (moved on by the velocities told with it) and in the new one. Their change d_k = h_old − h_new over the time between the
/// sets is the closing speed of the obstacles themselves: the motion of the arm drops out, and no point of one set has to be found
/// again in the other.
///
/// A change counts as motion once three sets in a row agree on it: over the shortest window of 2 to 12 changes (3 to 12 beyond 1 m/s) in which
///   - the clearance has lost at least 3 mm, and five times the noise of its changes, or half as much where it was closing before,
///   - no change differs by more than half of its share from a steady closing, plus the noise.
/// The noise is the running mean of how much one change differs from the next. A point that flickers opens and closes in turn: its
/// changes never agree. The same set again says nothing new. Until the next set is late, the clearance counts as smaller by closing
/// speed × age of the set, and as closing that much faster.
///
/// A clearance that a single set brought from above its margin to below is in doubt until three sets in a row, or as much time, show
/// the same; until then the arm does not come nearer, but does not move out either. Where something went away again before, it
/// takes twice and four times as many. A closing that is agreed on ends the doubt.
///
/// Coordinates are those of the field, which come first among those of a controller's system. Nothing allocates after construction.
class ClosingEstimate {
 public:
  /// `field`: the clearances, of that body; `margin`: theirs [m].
  ClosingEstimate(const Robot& robot, const Body& body, std::shared_ptr<const ClearanceField> field, double margin);

  /// The arm is at q (nv); `before`, which has been moved on to this moment, is about to be replaced. Only read, and not kept.
  void leave(ConstVectorRef q, const Obstacles& before) noexcept;
  /// After `leave`: `now` takes its place, at `time` [s]. The first set replaces nothing.
  void take(const Obstacles& now, double time) noexcept;

  /// Goes on with what another one found, of a body of the same links: an ellipsoid takes over what was found for the nearest one of its
  /// link. No allocation.
  void go_on_from(const ClosingEstimate& before) noexcept;

  /// Moves on to `time` [s]: what is late ends. Once in each step, after `take`.
  void advance(double time) noexcept;

  /// How far points of a part may be from where they are believed to be: reach + uncertainty of their velocity × age.
  struct Widening {
    double reach = 0.0;  // [m]
    double age = 0.0;    // [s]
  };
  /// Clearances count as smaller by that until the next call, but the arm is not led away for it: never as less than their margin.
  /// Null: none is wider. Not kept beyond a step.
  void widen(const Obstacles* obstacles, const std::array<Widening, most_sources>& parts) noexcept;

  /// Whether `corrected` would change anything.
  bool changes() const noexcept { return num_closing_ > 0 || num_doubted_ > 0 || widened_ != nullptr; }
  /// The same clearances with the closings found and the doubts: `seen` itself where there are none, else `out`, which is written.
  const Clearances& corrected(const Clearances& seen, Clearances& out) const noexcept;

  /// Closing speed of coordinate k beyond what its obstacles' velocities say [m/s], >= 0; 0 also of others than the field's.
  double speed(Eigen::Index k) const noexcept { return k < speeds_.size() ? speeds_[k] : 0.0; }
  /// Whether coordinate k is in doubt.
  bool is_doubted(Eigen::Index k) const noexcept { return k < speeds_.size() && doubts_[static_cast<std::size_t>(k)].sets > 0; }
  /// The least clearance that anything found closing would have after `duration` [s]; infinity where nothing closes.
  double nearest(double duration) const noexcept;

 private:
  static constexpr int most_changes = 12;  // Number of changes in a window.

  struct Track {
    std::array<double, most_changes> change{}, duration{};  // the newest at 0 [m], [s]
    int count = 0;
    double noise;          // [m]
    int differences;       // Number of differences that the noise is the mean of.
    double pending = 0.0;  // change since the last one that was kept [m]; NaN: not known
  };
  struct Doubt {
    int sets = 0;        // Sets that still have to show the same; 0: no doubt.
    double until = 0.0;  // [s]
    int flickers = 0;    // doubts that ended because something went away
    double last = -1e9;  // [s] the last of them
  };

  void evaluate(const Obstacles& obstacles, Clearances& out) noexcept;
  /// How much smaller the clearance to a point counts [m].
  double widening(Eigen::Index point) const noexcept;
  void keep(Track& track, double duration) noexcept;
  /// The closing speed that a track's changes agree on [m/s], 0: none; `closes`: there was one before.
  static double agreed(const Track& track, bool closes) noexcept;
  void doubt(Eigen::Index k, double before, double now, double duration, double time) noexcept;

  const Robot robot_;
  const std::shared_ptr<const ClearanceField> field_;
  const double margin_;
  const std::vector<std::string> links_;  // Links of the ellipsoids.
  const Eigen::Matrix3Xd middles_;        // Centres of the ellipsoids in the frames of their links [m].
  KinematicState state_;
  Eigen::VectorXd rest_;
  Clearances before_, now_;
  std::vector<Track> tracks_;
  std::vector<Doubt> doubts_;
  Eigen::VectorXd speeds_;                   // [m/s]
  double last_set_ = 0.0, last_kept_ = 0.0;  // [s]
  double late_ = 0.0, time_ = 0.0;           // [s] when the newest set is late; now
  bool begun_ = false;                       // a set was taken
  int num_closing_ = 0, num_doubted_ = 0;
  const Obstacles* widened_ = nullptr;
  std::array<Widening, most_sources> widenings_{};  // of each part
};

}  // namespace sidestep
