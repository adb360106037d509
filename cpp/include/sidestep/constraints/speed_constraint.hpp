#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/constraints/constraint.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

// From a limit of Cartesian speed that depends on distance to linear constraints on the acceleration.
//
// Allowed speed. Let d be the distance to the nearest obstacle. Between (d₀, V₀), near, and (d₁, V₁), far,
//     V(d)² = V₀² + 2 B (d − d₀),      B = (V₁² − V₀²) / 2 (d₁ − d₀),
// is the speed of constant deceleration B: an arm that approaches at V brakes with V' V = B everywhere, 1.2 m/s² by default.
// An obstacle that approaches with w needs B (1 + w/V), most where V is small. A straight line from V₀ to V₁ would need the
// most where the arm is fastest.
//
// One frame at p. Its speed s = |ṗ| changes by n·p̈ with n = ṗ/s, and p̈ = J q̈ + J̇ v. With V₊ the limit after this
// period, the difference V − s shrinks to no less than the share 1 − kT of it if
//     n·J q̈ ≤ (V₊ − V)/T + k (V − s) − n·J̇ v,      k = 50/s, no more than half per period.
// So the speed approaches its limit without a step in acceleration (the jerk k n·p̈ is half of the default jerk limit). If the
// limit is exceeded (an obstacle appears), the excess decays with the rate k. V stands for 98 % of the limit: the rest is
// for terms of order T², |p̈|² T²/2s, and for the onset of closing.
//
// A row demands at most its share of the stop along the path, n·J q̈ ≥ −s/τ with τ = max_j |v_j| / (acceleration limit)_j.
// −v/τ slows every frame by that and is within the acceleration limits, so one acceleration meets all rows. If clearances
// or torque limits prevent it, the rows give way together.

struct SpeedLimitSettings {
  double near_speed = 0.25;    ///< Speed V₀ allowed at near_distance and nearer [m/s].
  double near_distance = 0.1;  ///< Distance d₀ [m].
  double far_speed = 1.5;      ///< Speed V₁ allowed at far_distance and farther [m/s].
  double far_distance = 1.0;   ///< Distance d₁ [m].

  /// V [m/s] at a distance [m].
  double allowed(double distance) const noexcept;
  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};
template <>
const std::vector<Field<SpeedLimitSettings>>& fields();

/// Distinct frames of an arm that joints move, and their speeds.
class FrameSpeeds {
 public:
  explicit FrameSpeeds(const Robot& robot);

  /// Speed of the fastest frame [m/s], and its index (-1: none moves).
  struct Fastest {
    double speed = 0.0;
    int frame = -1;
  };
  Fastest fastest(const KinematicState& state) const noexcept;

  struct Place {
    int frame, joint;
    Eigen::Vector3d p;  // Place in the joint's child [m].
  };
  const std::vector<Place>& places() const noexcept { return places_; }

 private:
  std::vector<Place> places_;
};

/// Speed near obstacles: one row normal·q̈ ≤ upper per frame that joints move.
class SpeedConstraint : public Constraint {
 public:
  explicit SpeedConstraint(const Robot& robot);

  Priority priority() const noexcept override { return Priority::comfort; }
  int max_rows() const noexcept override { return static_cast<int>(frames_.size()); }
  void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept override;
  /// Names the frame that is slowed most.
  void report(const Moment& now, const Bounds& bounds, const RowBlock& rows, const Eigen::VectorXd& wanted,
              MotionSolution& solution) const noexcept override;

  const std::vector<int>& frames() const noexcept { return frames_; }  ///< Frame of each row.

 private:
  FrameSpeeds speeds_;
  std::vector<int> frames_;
};

}  // namespace sidestep
