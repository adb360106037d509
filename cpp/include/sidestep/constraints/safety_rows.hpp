#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/constraints/acceleration_bounds.hpp"
#include "sidestep/math/quadratic_program.hpp"
#include "sidestep/clearance/clearances.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// How one clearance may shrink.
struct ClosingLimits {
  double comfortable;  ///< A: deceleration [m/s²] that is planned with
  double hardest;      ///< deceleration [m/s²] that is demanded at most, when A turns out to be too little
  double rate;         ///< γ [1/s]: close to the margin the closing speed is γ times the room left
  double correction;   ///< fraction of an excess of closing speed that is taken away per period, in (0, 1]
};

// From a clearance to a linear constraint on the acceleration.
//
// Let s = h − margin be the room left and u = −dh/dt the closing speed, obstacle motion included. With c = d²h/dt² at
// q̈ = 0 and the acceleration a held for one period T, the closing speed is  w = u − (c + ∇h·a) T  afterwards, up to
// terms of order T². So a bound w ≤ w_max is one linear inequality,
//     ∇h·a ≥ (u − w_max)/T − c.
// h, u and c are those of what approaches most (Clearances::approach), not of what is nearest: a point ahead counts
// before one beside. But along a sampled surface the points change all the time, so that it does not recede as each of
// them does: where c is positive, it counts only as far as that of the nearest clearance is.
//
// Which closing speeds leave enough room? Close to the margin γ s, so that the room shrinks at most exponentially; the
// deceleration along that line is γ u, which a fast approach could not deliver. So from u = A/γ on, the parabola of
// constant deceleration A that continues the line with the same slope:
//     room needed   p(u) = u/γ                       for u ≤ A/γ,
//                   p(u) = u²/2A + A/2γ²             beyond,             p(−u) = −p(u).
// (The exponential line is the second-order exponential barrier condition h'' ≥ −(γ₁+γ₂)h' − γ₁γ₂ s with γ₂ → ∞; the
// parabola is what a plain barrier condition lacks: it knows how hard the arm can brake.)
//
// Sampled exactly. The next state has to be viable, p(w) ≤ s₊, both under exact integration, s₊ = s − T(u + w)/2, and
// under semi-implicit Euler, s₊ = s − T w:
//     p(w) + c T w ≤ s − (1 − c) T u,       c = 1/2 when braking (w < u), 1 when not,
// whose largest solution is a root of a line or a parabola. If s ≥ p(u) now, then decelerating by at most A meets it:
// on the parabola w = u − AT under exact integration gives p(u) − p(w) = T(u + w)/2 with equality, on the line less
// than γ u ≤ A does, and semi-implicit Euler needs less. So for one clearance on its own, with deceleration A
// available, the margin is kept for ever and no more than A is ever demanded, whatever T is.
//
// Several clearances at once. Each may count on all joints for itself, and they may want opposite things of the same
// joint. What they all can rely on is that the arm stops along its path: the acceleration −v/τ, by which every closing
// speed decelerates by u/τ, is within the limits with τ = max_j |v_j| / (acceleration limit)_j, and within the torque
// if τ is as long as |bias − M v/τ| <= effort takes (up to ten times as long). A line of slope γ demands γ u. So with γ
// <= 1/τ one and the same acceleration meets all rows on their lines: γ is the smaller of `rate` and 1/τ.
//
// Outside (s < p(u): an obstacle that appeared, a disturbance, another constraint that won) meeting it at once would
// be a demand of order 1/T. Instead the excess e of closing speed over p⁻¹(s) decays: the demand is at most what
// the profile itself decelerates with, plus correction·e/T, and never above the hardest deceleration the limits allow.
// While room is left, neither is it above what a stop takes, γ u or, if that is more, u²/2(s − uT). So among obstacles
// at rest, as long as u ≤ 2γ (s − uT) and curvatures aside, one and the same acceleration still meets all rows, that of
// the stop along the path; more could only be had by one row at the expense of another, or of limits. The stop is asked
// for anew in every period: what disturbs makes the demand grow before s is gone, with the logarithm of s; what is then
// not to be had goes into the margin.
// A room that is negative grows back to p⁻¹(s) < 0: closing ends as above, and the leaving speed e that is missing
// comes by 3γ e, on the line s'' = −3γ s' − 2γ² s: firmly, but without a demand of order 1/T, and never above A. So
// what closes in is slowed harder than at rest, however deep it is: where clearances want opposite things, the arm
// comes to rest. What comes nearer by v unseen (an obstacle whose velocity is not given) is held off at s = −1.5 v/γ,
// an acceleration d that is not known of at −d/2γ².
//
// What a row may ask for. The curvature c adds to the demand, other rows want something else, and close to position
// limits joints cannot give all: no more than b = max ∇h·a within the bounds of now and the torque. With b the room
// lasts if the arm comes no nearer, or stops in time, u²/2(b + min(c, 0)) <= s.
// Where nothing but the arm itself closes in (by more than 0.01 m/s, which the margin holds off), its stop along the
// path settles what is needed: κ times as hard as −v/τ it takes the time τ/κ and the way v τ/2κ, on which the clearance
// falls by
//     u τ/2κ + max(−c, 0) τ²/8κ²,
// which is s for a κ in closed form. If κ <= 1 a row asks for no more than its share −∇h·v/τ of that stop, so that −v/τ
// meets all such rows at once. Otherwise, if it demands more than b, it asks for no more than κ times its share, nor
// than b if with b the room lasts. Where b + c <= 0, as past the crest of a clearance where ∇h is short, no
// acceleration along ∇h would do, and the arm is to stop along its path as well, by one more row, −v·q̈ >= κ |v|²/τ,
// for the row of the largest κ. κ is no larger than twice what meets the demand, nor than takes `correction` of the
// velocity in this period; bounds of comfort are exceeded κ times by it.
// Where something else closes in, or the room is used up, a row asks for no more than b if with b the room lasts. Only
// where it does not are bounds of comfort given up for it; where the room is used up, only for the end of closing, and
// not for the way back: what is asked for does not jump where closing turns into leaving.

// With a jerk limit. Where a row first binds, the arm may still accelerate towards the obstacle, and would have to brake at
// once. It need not: a row asks for no more than jerk allows next, as long as the smooth stop that begins with it,
//     S(u, −(∇h·a + c)) at a share of the jerk J = Σ |∂h/∂q_j| J_j and at three quarters of the hardest deceleration,
// fits into the room, S of acceleration_bounds.hpp. The share is one half, so that two rows can rise together; where that is not
// enough, all but a twentieth. Where neither is, as with what comes into view late, jerk gives way.
// Several rows together may ask for more than jerk allows, each within its share. Before jerk gives way for them, they draw
// on their reserves: each asks for as little as still lets the arm's own stop along its path fit into the room, by −v/τ and
// with all but a twentieth of the jerk. That is one stop for all rows; what closes in by more has no reserve. Of what is
// known and not seen, as of links against each other, four fifths of the margin count as room then: they are for what sensors
// miss. A row without room asks only for what keeps it from closing, and its way back shares with others what the jerk limits
// leave. Where what is lost comes nearer, nothing waits; else its way out shares what the jerk limits leave.
// Where torques have to keep a rate, jerk is a small part of its limit, and a row begins early: of the ∇h·a that jerk allows next
// it asks for the least after which the smooth stop fits (or for the most, where none fits), without a curvature that helps, which
// may be gone before the arm has slowed. And it asks for no more than rate and jerk limits can do next: beyond it light joints
// would be flung about, for next to nothing. While the arm is led past an obstacle, rows do not begin early: they would hold it back.

/// The deceleration (u − w_max)/T [m/s²] that a clearance with `room` s [m] (may be negative) and closing speed u [m/s]
/// demands; negative while it may still close faster. Finite for finite arguments; limits may be infinite.
double demanded_deceleration(double room, double closing_speed, const ClosingLimits& limits, double period) noexcept;

struct SafetySettings {
  /// Clearance that is kept [m]. Covers what the model does not see: the reduction over points is high by up to its
  /// temperature (2 mm by default), tracking error, one period of delay, and 1.5/rate times what obstacles move without
  /// saying so: 5 mm hold off what comes by up to 0.06 m/s. `Clearances::margins` where they are less.
  double margin = 0.005;
  /// γ [1/s] of a slow arm. Larger lets it come close quicker and reacts more to noise; γT must stay well below 1.
  double rate = 20.0;
  /// A over the largest deceleration that the joint limits allow in the direction of ∇h [-]. What is left serves the
  /// curvature c, other clearances and limits, and joints that cannot give all at once.
  double braking_fraction = 0.5;
  /// Fraction of an excess of closing speed that is taken away per period [-].
  double correction = 0.5;
  /// When more clearances are active, those are kept of which s − u/γ is smallest [-].
  int max_rows = 32;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};
template <>
const std::vector<Field<SafetySettings>>& fields();

/// What the torque adds to the knowledge of how hard the arm can brake: M, its Cholesky factor, and the bias.
struct BrakingTorque {
  const Eigen::MatrixXd& mass;
  const Eigen::MatrixXd& mass_cholesky;
  const Eigen::VectorXd& bias;
};

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

/// One linear constraint on the acceleration per clearance, normal·q̈ ≥ lower, with unit normals ∇h/|∇h|; and at most
/// one for a stop along the path, with the normal −v/|v|, and the clearance and length for which it is asked (where
/// rows are full it takes the place of the least critical).
class SafetyRows {
 public:
  /// Throws std::invalid_argument if the settings are not valid.
  SafetyRows(int num_coordinates, SafetySettings settings);

  void clear() noexcept {
    size_ = 0;
    helpless = -1;
  }

  /// Whether the sizes match and every entry within reach is finite.
  bool usable(const Clearances& clearances) const noexcept;

  /// The most critical clearances of usable ones, at velocity v (nv). The hardest deceleration is Σ_j |∂h/∂q_j|
  /// (acceleration limit)_j or, given the torque, (M⁻¹∇h)·(torque − bias) at the effort limits, whichever is less. The
  /// comfortable one is a share of what both allow together, max ∇h·a with |a| and |M a + bias| within their limits.
  /// `bounds` are those of now. No allocation.
  void update(const Clearances& clearances, const Eigen::VectorXd& v, const JointLimits& limits,
              const AccelerationBounds& bounds, double period, const BrakingTorque* torque = nullptr,
              const LastMotion* last = nullptr) noexcept {
    clear();
    add(clearances, v, limits, bounds, period, torque, last);
  }

  /// Adds those at another state: where both are too many, either keeps at least half of the rows.
  void add(const Clearances& clearances, const Eigen::VectorXd& v, const JointLimits& limits, const AccelerationBounds& bounds,
           double period, const BrakingTorque* torque = nullptr, const LastMotion* last = nullptr) noexcept;

  /// Asks for as little as each clearance can do with next, see above; false where no row has a reserve. After `add`, where no
  /// clearance is lost.
  bool draw_on_reserves(double period) noexcept;
  /// After it: asks for all of it again.
  void ask_again() noexcept;
  /// After it: asks in full for the ways back that were put off, false where none was: by another row for each that is not lost, which
  /// counts as one that is, so that what keeps it from closing still counts more.
  bool ask_for_ways_back() noexcept;
  /// After `add`, where a clearance is lost. Those that oppose its way out, are known and not seen, and are inside their margin, ask
  /// for a fifth of it only; and for the rest after the way out, by another row each.
  void put_off_ways_back(double period) noexcept;

  /// Whether every acceleration with lower <= q̈ <= upper satisfies row k.
  bool satisfied_within(int k, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) const noexcept;

  int size() const noexcept { return size_; }
  int max_size() const noexcept { return settings_.max_rows; }
  const SafetySettings& settings() const noexcept { return settings_; }

  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMatrix normals;             ///< (max, nv), the first size() in use
  Eigen::VectorXd lower;         ///< (max) [rad/s²]: required/length
  Eigen::VectorXd lengths;       ///< (max) |∇h| [m/rad]
  std::vector<int> coordinates;  ///< (max) which clearance a row belongs to, most critical first
  std::vector<int> nearest;      ///< (max) its nearest obstacle point
  Eigen::VectorXd depths;        ///< (max) [m] how far below zero the clearance is, else 0: that of what approaches
  std::vector<char> along_path;  ///< (max) whether a row asks for a stop along the path
  int helpless = -1;             ///< a clearance that asks for something and that no joint changes; -1: none

 private:
  /// τ [s], see above.
  double stop_time(const Eigen::VectorXd& v, const JointLimits& limits, const BrakingTorque* torque) noexcept;
  /// Writes M⁻¹ ∇h of the rows chosen, side by side: divisions of one wait for each other.
  void find_responses(int first, const ClearanceState& approach, const Eigen::MatrixXd& mass_cholesky) noexcept;
  double hardest_by_torque(int row, const JointLimits& limits, const BrakingTorque& torque) const noexcept;
  /// max direction·a with lower <= a <= upper and row_lower <= M a <= row_upper; `otherwise` where there is no such a.
  double largest_by_both(ConstVectorRef direction, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                         const Eigen::VectorXd& row_lower, const Eigen::VectorXd& row_upper, double otherwise) noexcept;

  /// What a row asks for where jerk is limited, see above: more early, or less where a smooth stop at A fits into the room.
  static double smoothed(double required, double room, double closing_speed, double curvature, double A,
                         ConstVectorRef gradient, const LastMotion& last, const AccelerationBounds& bounds,
                         const JointLimits& limits, double period) noexcept;

  /// What the stop of a row can count on: in [m], [m/s], [m/s²], [m/s³]; no jerk [m/s³]: nothing is known of it.
  struct Reserve {
    double room = 0.0, closing_speed = 0.0, curvature = 0.0, hardest = 0.0, jerk = 0.0;
    double before = 0.0;  ///< ∇h·a of the last period
    double margin = 0.0;
    bool seen = false;  ///< by a sensor: its whole margin counts
    ClosingLimits limits{};
  };

  bool opposes_lost(int row) const noexcept;

  SafetySettings settings_;
  int size_ = 0;
  std::vector<Reserve> reserves_;                // (max)
  Eigen::VectorXd asked_;                        // (max) before reserves are drawn on
  Eigen::VectorXd urgency_;                      // (max) predicted room of the rows chosen, ascending
  Eigen::VectorXd response_;                     // (nv) M v
  RowMatrix responses_;                          // (nv, max) M⁻¹ ∇h of the rows chosen
  Eigen::VectorXd least_;                        // (nv) −(acceleration limits)
  Eigen::VectorXd effort_lower_, effort_upper_;  // (nv) of M q̈
  QuadraticProgramData reach_data_;
  QuadraticProgram reach_;  // what a direction can have within accelerations and torques
};

}  // namespace sidestep
