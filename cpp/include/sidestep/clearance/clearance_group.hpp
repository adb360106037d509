#pragma once

#include <algorithm>
#include <limits>

#include "sidestep/clearance/clearances.hpp"
#include "sidestep/clearance/coordinate_label.hpp"
#include "sidestep/clearance/stopping_clearance.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Clearances of one kind with their derivatives: of ellipsoids to obstacles, of pairs of links, and so on.
class ClearanceGroup {
 public:
  /// Largest share of an activation distance that two links or a plane, which no sensor sees, keep as a margin [-].
  static constexpr double margin_share = 0.5;

  virtual ~ClearanceGroup() = default;

  virtual int size() const noexcept = 0;
  /// Label of clearance k, without a floor. Allocates: for construction, not for the loop.
  virtual CoordinateLabel label(int k) const = 0;

  /// Writes the clearances below `reach` [m] at a state into `out`, which the caller has cleared, and the critical samples
  /// within the horizon. No allocation.
  virtual void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                        ClearanceView out) const noexcept = 0;

  /// Longest activation distance that makes sense for clearance k [m]. Link pairs that are always close use a shorter one: nine
  /// tenths of the usual clearance if that is below 11 mm. A longer one would always be active and hold the links to no
  /// purpose, as for a wrist whose parts pass 4 mm apart all the way round.
  virtual double longest_activation(int /*k*/) const noexcept { return std::numeric_limits<double>::infinity(); }

  /// Whether the clearances are from points that a sensor sees, with errors that the safety margin covers.
  virtual bool is_seen() const noexcept { return false; }

  /// Whether balls inside the body's parts reach deeper than `depth` [m] into an obstacle. If they do not, the parts still may.
  /// Much quicker than `evaluate`. No allocation.
  virtual bool touches(const KinematicState& /*state*/, const Obstacles& /*obstacles*/, double /*depth*/) const noexcept {
    return false;
  }

 protected:
  ClearanceGroup() = default;
  ClearanceGroup(const ClearanceGroup&) = default;
  ClearanceGroup& operator=(const ClearanceGroup&) = default;

  /// Clearance below which two links are usually near [m], see `longest_activation`.
  static constexpr double usually_near = 0.011;
  /// The longest activation distance [m] of two links, from the median of their clearances [m] over the whole range.
  static double activation_for_usual(double median) noexcept {
    constexpr double share = 0.9;    // Activation distance as a share of the usual clearance [-].
    constexpr double least = 0.001;  // Shortest activation distance [m].
    return median > 0.0 && median < usually_near ? std::max(share * median, least) : std::numeric_limits<double>::infinity();
  }
};

}  // namespace sidestep
