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

/// Bounds of the next q̈ by the jerk limits, and of the next M q̈ by the torque rate limits (nv).
struct RateLimits {
  const Eigen::VectorXd& acceleration_lower;
  const Eigen::VectorXd& acceleration_upper;
  const Eigen::VectorXd& torque_lower;
  const Eigen::VectorXd& torque_upper;
};

/// Motion of the last period.
struct LastMotion {
  const Eigen::VectorXd& acceleration;  ///< Acceleration (nv) [/s²].
  double jerk_share;                    ///< Share of the jerk limits that may be used [-].
  bool early = false;                   ///< Whether rows brake early enough that torque keeps its rate.
  bool lost = false;  ///< Whether a clearance is lost and comes nearer: recovery then does not wait for the jerk limit.
  const RateLimits* rates = nullptr;  ///< Rate limits of torque; null: none.
};

/// State and limits for which clearances are bounded.
struct BrakingState {
  const Eigen::VectorXd& v;  ///< Velocity (nv) [/s].
  const JointLimits& limits;
  const AccelerationBounds& bounds;       ///< Bounds of this period.
  double period;                          ///< Period [s].
  const BrakingTorque* torque = nullptr;  ///< Dynamics; null: torque never limits braking.
  const LastMotion* last = nullptr;       ///< Motion of the last period; null: no jerk limit.
};

/// Rows normal·q̈ ≥ lower, one per clearance with the unit normal ∇h/|∇h|, see clearance_demand.hpp.
///
/// One more row may require a stop along the path. It has the normal −v/|v| and the clearance and length for which the stop is
/// required. If all rows are in use, it replaces the least critical one.
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
              MotionSolution& solution) const noexcept override;

  /// Weakens each row to the least with which the current stop still fits into its distance, see clearance_demand.hpp. False: no row
  /// can be weakened. Only while no clearance is lost.
  bool relax_to_braking(const Moment& now, RowBlock& rows) noexcept override { return relax_to_braking(now.period, rows); }
  bool relax_to_braking(double period, RowBlock& rows) noexcept;
  void restore(RowBlock& rows) noexcept override;
  /// Adds a second row per clearance, with the rank of a lost one, so that stopping the approach still ranks higher.
  bool add_recovery(RowBlock& rows) noexcept override;
  /// Reduces clearances that oppose the way out of a lost one to a fifth of their margin, and asks for the rest by another row
  /// that ranks after the way out. Only clearances that are known, not seen by a sensor, and inside their margin.
  void defer_recovery(const Moment& now, RowBlock& rows) noexcept override { defer_recovery(now.period, rows); }
  void defer_recovery(double period, RowBlock& rows) noexcept;

  /// Whether the sizes match and every entry within reach is finite.
  bool usable(const Clearances& clearances) const noexcept;
  /// Appends rows of the most critical clearances. If those of a first state are there already and there are too many, they keep
  /// at most half of the rows. The hardest deceleration is Σ_j |∂h/∂q_j| (acceleration limit)_j or, given the torque,
  /// (M⁻¹∇h)·(torque − bias) at the effort limits, whichever is less. The comfortable one is a share of what both allow together,
  /// max ∇h·a with |a| and |M a + bias| within their limits.
  void add(const Clearances& clearances, const BrakingState& state, RowBlock& rows) noexcept;

  const SafetySettings& settings() const noexcept { return settings_; }
  /// Clearance of each row, most critical first.
  const std::vector<int>& coordinates() const noexcept { return coordinates_; }
  /// Nearest obstacle point of each row.
  const std::vector<int>& nearest() const noexcept { return nearest_; }
  /// Whether each row requires a stop along the path.
  const std::vector<char>& along_path() const noexcept { return along_path_; }

 private:
  /// Reserve of a row: the stop that it can rely on. Jerk 0 [m/s³]: none is known.
  struct Reserve {
    double distance_left = 0.0, closing_speed = 0.0, curvature = 0.0, hardest = 0.0, jerk = 0.0;
    double before = 0.0;  ///< ∇h·a of the last period [m/s²].
    double margin = 0.0;
    bool seen = false;  ///< Whether a sensor sees it: its whole margin counts.
    ClosingLimits limits{};
  };
  /// Stop along the path of one state: its time τ [s], the rate γ of its lines [1/s], and the jerk of v [1/s²].
  struct PathStop {
    double tau, rate, jerk;
    double hardest = 0.0;  ///< κ of the row that needs it most
    int row = -1;
  };
  /// One closing clearance: distance left s, closing speed u, curvature c, and the decelerations that the arm has against it.
  struct Closing {
    double distance_left, u, c;
    double of_arm;        ///< Closing speed by the arm's own motion [m/s].
    double hardest, now;  ///< κ of the row that needs it most [-].
    bool lasts;           ///< Whether the distance lasts with `now`.
    double net;           ///< `now` without a curvature that helps [m/s²].
    ClosingLimits limits;
  };

  void choose(const Clearances& clearances, const PathStop& stop, double period, int first, RowBlock& rows) noexcept;
  double distance_left_of(const Clearances& clearances, Eigen::Index k) const noexcept;
  /// The closing of row `row`; writes its first demand.
  Closing closing_of(int row, const Clearances& clearances, const BrakingState& state, const PathStop& stop,
                     double& required) noexcept;
  /// The demand, reduced to what the stop along the path and the distance left require.
  double without_excess(double required, const Closing& closing, int row, double period, PathStop& stop) const noexcept;
  /// The demand, reduced to what jerk and torque rate allow.
  double with_jerk(double asked, const Closing& closing, int row, ConstVectorRef gradient, const BrakingState& state,
                   PathStop& stop) noexcept;
  /// The demand with a jerk limit: more early, or less where a smooth stop at A fits into the distance left.
  static double smoothed(double required, double distance_left, double closing_speed, double curvature, double A,
                         ConstVectorRef gradient, const LastMotion& last, const AccelerationBounds& bounds,
                         const JointLimits& limits, double period) noexcept;
  double within_rates(ConstVectorRef direction, double asked, const RateLimits& rates) noexcept;
  void append_stop(const PathStop& stop, const BrakingState& state, RowBlock& rows) noexcept;
  bool opposes_lost(const RowBlock& rows, int row) const noexcept;

  JointLimits limits_;
  SafetySettings settings_;
  bool effort_is_limited_;
  std::vector<int> coordinates_, nearest_;   // Clearance and nearest point of each row (max).
  std::vector<char> along_path_;             // Whether each row requires a stop along the path (max).
  std::vector<Reserve> reserves_;            // Reserve of each row (max).
  Eigen::VectorXd asked_;                    // Bounds before relax_to_braking (max).
  Eigen::VectorXd urgency_;                  // Predicted distances left of the chosen rows (max) [m], ascending.
  Eigen::VectorXd least_;                    // −(acceleration limits) (nv).
  Eigen::VectorXd next_lower_, next_upper_;  // Accelerations that the jerk limits allow next (nv) [/s²].
  BrakingLimits braking_;
};

}  // namespace sidestep
