#pragma once

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

/// The deceleration (u − w_max)/T [m/s²] that a clearance with `distance_left` s [m] (may be negative) and closing speed u [m/s]
/// demands; negative while it may still close faster. Finite for finite arguments; limits may be infinite.
double demanded_deceleration(double distance_left, double closing_speed, const ClosingLimits& limits, double period) noexcept;

}  // namespace sidestep
