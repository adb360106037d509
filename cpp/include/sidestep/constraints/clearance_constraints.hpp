#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/clearance/clearances.hpp"
#include "sidestep/constraints/braking_limits.hpp"
#include "sidestep/constraints/clearance_demand.hpp"
#include "sidestep/constraints/constraint.hpp"
#include "sidestep/constraints/safety_settings.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Of torques that have to keep a rate: between what q̈ may be next by the jerk limits, and M q̈ by the rate (nv).
struct RateLimits {
  const Eigen::VectorXd& acceleration_lower;
  const Eigen::VectorXd& acceleration_upper;
  const Eigen::VectorXd& torque_lower;
  const Eigen::VectorXd& torque_upper;
};

/// The acceleration of the last period (nv) [/s²], the share of the jerk limits that there is, and whether rows brake early for it.
struct LastMotion {
  const Eigen::VectorXd& acceleration;
  double jerk_share;
  bool early = false;
  bool lost = false;                  ///< a clearance is, and comes nearer: ways out do not wait for the jerk
  const RateLimits* rates = nullptr;  ///< null: none
};

/// State and limits that clearances are bounded for.
struct BrakingState {
  const Eigen::VectorXd& v;  ///< (nv)
  const JointLimits& limits;
  const AccelerationBounds& bounds;       ///< those of now
  double period;                          ///< [s]
  const BrakingTorque* torque = nullptr;  ///< null: torque never is what braking lacks
  const LastMotion* last = nullptr;       ///< null: no jerk limit
};

/// Clearances: one row normal·q̈ ≥ lower per clearance with unit normals ∇h/|∇h|, see clearance_demand.hpp; and at most one for a
/// stop along the path, with the normal −v/|v|, and the clearance and length for which it is asked (where rows are full it
/// takes the place of the least critical).
class ClearanceConstraints : public Constraint {
 public:
  /// Throws std::invalid_argument if the settings are not valid.
  ClearanceConstraints(JointLimits limits, SafetySettings settings);

  Priority priority() const noexcept override { return Priority::clearance; }
  int max_rows() const noexcept override { return settings_.max_rows; }
  bool usable(const Moment& now) const noexcept override;
  void survey(const Moment& now, Survey& found) const noexcept override;
  void append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept override;
  void report(const Moment& now, const Bounds& bounds, const RowBlock& rows, const Eigen::VectorXd& wanted,
              TorqueSolution& solution) const noexcept override;

  /// Each row asks for the least that still lets the arm's own stop fit into its distance, see clearance_demand.hpp; false where no
  /// row can ask for less. Where no clearance is lost.
  bool relax_to_braking(const Moment& now, RowBlock& rows) noexcept override { return relax_to_braking(now.period, rows); }
  bool relax_to_braking(double period, RowBlock& rows) noexcept;
  void restore(RowBlock& rows) noexcept override;
  /// By another row for each clearance that is not lost, which counts as one that is, so that what keeps it from closing still
  /// counts more.
  bool add_recovery(RowBlock& rows) noexcept override;
  /// Clearances that oppose the way out of a lost one, are known and not seen, and are inside their margin, ask for a fifth of it
  /// only; and for the rest after the way out, by another row each.
  void defer_recovery(const Moment& now, RowBlock& rows) noexcept override { defer_recovery(now.period, rows); }
  void defer_recovery(double period, RowBlock& rows) noexcept;

  /// Whether the sizes match and every entry within reach is finite.
  bool usable(const Clearances& clearances) const noexcept;
  /// Appends the most critical clearances of usable ones: after those of another state, where both are too many, at least half of
  /// the rows. The hardest deceleration is Σ_j |∂h/∂q_j| (acceleration limit)_j or, given the torque, (M⁻¹∇h)·(torque − bias) at
  /// the effort limits, whichever is less. The comfortable one is a share of what both allow together, max ∇h·a with |a| and
  /// |M a + bias| within their limits.
  void add(const Clearances& clearances, const BrakingState& state, RowBlock& rows) noexcept;

  const SafetySettings& settings() const noexcept { return settings_; }
  const std::vector<int>& coordinates() const noexcept { return coordinates_; }  ///< clearance of each row, most critical first
  const std::vector<int>& nearest() const noexcept { return nearest_; }          ///< nearest obstacle point of each row
  const std::vector<char>& along_path() const noexcept {
    return along_path_;
  }  ///< whether a row asks for a stop along the path

 private:
  /// What the stop of a row can count on; no jerk [m/s³]: nothing is known of it.
  struct Reserve {
    double distance_left = 0.0, closing_speed = 0.0, curvature = 0.0, hardest = 0.0, jerk = 0.0;
    double before = 0.0;  ///< ∇h·a of the last period
    double margin = 0.0;
    bool seen = false;  ///< by a sensor: its whole margin counts
    ClosingLimits limits{};
  };
  /// The stop along the path of one state: its time τ [s], the rate γ of its lines [1/s], and the jerk of v [1/s²].
  struct PathStop {
    double tau, rate, jerk;
    double hardest = 0.0;  ///< κ of the row that needs it most
    int row = -1;
  };
  /// One clearance that closes: distance left s, closing speed u, curvature c, and what the arm has against it.
  struct Closing {
    double distance_left, u, c;
    double of_arm;        ///< closing speed by the arm's own motion
    double hardest, now;  ///< decelerations: by the limits, and within the bounds of now
    bool lasts;           ///< with `now` the room lasts
    double net;           ///< `now` without a curvature that helps
    ClosingLimits limits;
  };

  void choose(const Clearances& clearances, const PathStop& stop, double period, int first, RowBlock& rows) noexcept;
  double distance_left_of(const Clearances& clearances, Eigen::Index k) const noexcept;
  /// The closing of row `row`, and what it demands at first.
  Closing closing_of(int row, const Clearances& clearances, const BrakingState& state, const PathStop& stop,
                     double& required) noexcept;
  /// What the stop along the path, and the room, leave of a demand.
  double without_excess(double required, const Closing& closing, int row, double period, PathStop& stop) const noexcept;
  /// What jerk and rate leave of it.
  double with_jerk(double asked, const Closing& closing, int row, ConstVectorRef gradient, const BrakingState& state,
                   PathStop& stop) noexcept;
  /// What a row asks for where jerk is limited: more early, or less where a smooth stop at A fits into the room.
  static double smoothed(double required, double distance_left, double closing_speed, double curvature, double A,
                         ConstVectorRef gradient, const LastMotion& last, const AccelerationBounds& bounds,
                         const JointLimits& limits, double period) noexcept;
  double within_rates(ConstVectorRef direction, double asked, const RateLimits& rates) noexcept;
  void append_stop(const PathStop& stop, const BrakingState& state, RowBlock& rows) noexcept;
  bool opposes_lost(const RowBlock& rows, int row) const noexcept;

  JointLimits limits_;
  SafetySettings settings_;
  bool effort_is_limited_;
  std::vector<int> coordinates_, nearest_;   // (max)
  std::vector<char> along_path_;             // (max)
  std::vector<Reserve> reserves_;            // (max)
  Eigen::VectorXd asked_;                    // (max) before relax_to_braking
  Eigen::VectorXd urgency_;                  // (max) predicted room of the rows chosen, ascending
  Eigen::VectorXd least_;                    // (nv) −(acceleration limits)
  Eigen::VectorXd next_lower_, next_upper_;  // (nv) what jerk limits leave next
  BrakingLimits braking_;
};

}  // namespace sidestep
