#pragma once

namespace sidestep {

/// How one clearance may shrink.
struct ClosingLimits {
  double comfortable;  ///< Deceleration A that is planned with [m/s²].
  double hardest;      ///< Largest deceleration that is demanded, if A turns out to be too little [m/s²].
  double rate;         ///< Ratio γ of closing speed to distance left, close to the margin [1/s].
  double correction;   ///< Fraction of an excess of closing speed that is removed per period, in (0, 1].
};

// From a clearance to a linear constraint on the acceleration.
//
// Let s = h − margin be the distance left and u = −dh/dt the closing speed, obstacle motion included. With c = d²h/dt² at
// q̈ = 0 and the acceleration a held for one period T, the closing speed afterwards is  w = u − (c + ∇h·a) T, up to terms
// of order T². So a bound w ≤ w_max is one linear inequality,
//     ∇h·a ≥ (u − w_max)/T − c.
// h, u and c are those of the most critical point (Clearances::approach), not of the nearest: a point ahead counts before
// one beside. Along a sampled surface this point changes all the time, so the surface recedes less than each of its points
// does. A positive c therefore counts only up to that of the nearest clearance.
//
// Admissible closing speeds. Close to the margin the bound is u ≤ γ s, so that s shrinks at most exponentially. The
// deceleration along that line is γ u, too much for a fast approach. From u = A/γ on, the line continues with the same
// slope as a parabola of constant deceleration A:
//     distance needed   p(u) = u/γ                   for u ≤ A/γ,
//                       p(u) = u²/2A + A/2γ²         beyond,             p(−u) = −p(u).
// (The line is the second-order exponential barrier condition h'' ≥ −(γ₁+γ₂)h' − γ₁γ₂ s with γ₂ → ∞. The parabola adds
// what a plain barrier condition lacks: how hard the arm can brake.)
//
// Exact sampling. The next state has to be viable, p(w) ≤ s₊, both under exact integration, s₊ = s − T(u + w)/2, and
// under semi-implicit Euler, s₊ = s − T w:
//     p(w) + c T w ≤ s − (1 − c) T u,       c = 1/2 when braking (w < u), 1 when not.
// Its largest solution is a root of a line or a parabola. If s ≥ p(u) now, a deceleration of at most A meets it: on the
// parabola w = u − AT gives p(u) − p(w) = T(u + w)/2 with equality under exact integration, on the line less than γ u ≤ A
// suffices, and semi-implicit Euler needs less. So a single clearance keeps its margin for ever and never demands more
// than A, for any T.
//
// Several clearances. Each assumes that all joints serve it, and they may want opposite things of the same joint. What
// all can rely on is a stop of the arm along its path. The acceleration −v/τ decelerates every closing speed by u/τ. It is
// within the acceleration limits with τ = max_j |v_j| / (acceleration limit)_j, and within the torque limits with a τ for
// which |bias − M v/τ| <= effort (up to ten times as long). A line of slope γ demands γ u. So with γ <= 1/τ one
// acceleration meets all rows on their lines: γ is the smaller of `rate` and 1/τ.
//
// Outside, s < p(u): an obstacle appeared, a disturbance acted, or another constraint won. Returning at once would be a
// demand of order 1/T. Instead the excess e of closing speed over p⁻¹(s) decays. The demand is at most the deceleration of
// the profile plus correction·e/T, and at most the hardest deceleration that the limits allow. While s > 0 it is also at
// most that of a stop, γ u or, if that is more, u²/2(s − uT). So among obstacles at rest, as long as u ≤ 2γ (s − uT) and
// without curvatures, the stop along the path still meets all rows; a row could get more only at the expense of another
// row, or of limits. The stop is computed anew in every period: a disturbance makes the demand grow before s is used up,
// with the logarithm of s, and whatever is then not available goes into the margin.
//
// Negative s grows back to p⁻¹(s) < 0. Closing ends as above. A missing leaving speed e is made up by 3γ e, on the line
// s'' = −3γ s' − 2γ² s: firmly, but without a demand of order 1/T, and never above A. So the approach is slowed harder
// than rest is left, at any depth: where clearances want opposite things, the arm comes to rest. An obstacle that
// approaches with an unknown velocity v is held off at s = −1.5 v/γ, one with an unknown acceleration d at −d/2γ².
//
// Limits of the demand. The curvature c adds to it, other rows want something else, and close to position limits the
// joints provide no more than b = max ∇h·a within the present bounds and the torque. With b the distance lasts if the
// clearance does not close, or stops in time, u²/2(b + min(c, 0)) <= s.
//
// 1. Only the arm's own motion closes (others by at most 0.01 m/s, which the margin holds off). Then its stop along the
//    path settles the demand. A stop κ times as hard as −v/τ takes the time τ/κ and the way v τ/2κ, on which the clearance
//    falls by
//        u τ/2κ + max(−c, 0) τ²/8κ²,
//    which is s for a κ in closed form. If κ <= 1, a row demands at most its share −∇h·v/τ of that stop, so that −v/τ meets
//    all such rows at once. Otherwise, if the demand exceeds b, it is reduced to κ times that share and, if the distance
//    lasts with b, to b. If b + c <= 0, as past the crest of a clearance where ∇h is short, no acceleration along ∇h
//    suffices. One more row, −v·q̈ >= κ |v|²/τ, then requires a stop along the path, for the row of the largest κ. κ is at
//    most twice what meets the demand, and at most what removes `correction` of the velocity in this period; bounds of
//    comfort are exceeded κ times by it.
// 2. Something else closes too, or s <= 0. A row demands at most b if the distance lasts with b. Only otherwise do bounds
//    of comfort give way to it; with s <= 0 only to end the approach, not for recovery. So the demand does not jump where
//    closing turns into leaving.

// With a jerk limit. When a row first binds, the arm may still accelerate towards the obstacle and would have to brake at
// once. Instead a row demands at most what jerk allows next, as long as the smooth stop that begins with it,
//     S(u, −(∇h·a + c)) at a share of the jerk J = Σ |∂h/∂q_j| J_j and at three quarters of the hardest deceleration,
// fits into s, with S of acceleration_bounds.hpp. The share is one half, so that two rows can rise together; if that is
// too little, all but a twentieth. If that is too little as well, as for an obstacle that appears late, jerk gives way.
//
// Several constraints together can require more jerk than is available. Before we relax the jerk limit, we weaken each
// constraint to the least that keeps the current stop feasible: −v/τ, with all but a twentieth of the jerk, fits into its
// s. That is one stop for all rows. A clearance that something else closes is not weakened. Between links, whose clearance
// is known and not seen by a sensor, four fifths of the margin count as distance left here: they are for sensor errors.
//
// A violated constraint only has to stop the approach; recovery uses whatever jerk is left. If the margin is violated but
// the distance is no longer shrinking, recovery respects the jerk limit. The same holds in contact. Only a lost clearance
// that still shrinks does not wait for the jerk limit.
//
// With torque rate limits, the available jerk is a small part of its limit, and a row brakes early. Among the ∇h·a that jerk
// allows next, it demands the least after which the smooth stop fits, or the most if none fits. A helpful curvature does
// not count: it may be gone before the arm has slowed. A row demands at most what rate and jerk limits allow next: more
// would fling light joints about for little effect. While the arm is led past an obstacle, rows do not brake early, since
// that would hold it back.

/// The deceleration (u − w_max)/T [m/s²] that a clearance with `distance_left` s [m] (may be negative) and closing speed u [m/s]
/// demands. Negative while it may still close faster. Finite for finite arguments; limits may be infinite.
double demanded_deceleration(double distance_left, double closing_speed, const ClosingLimits& limits, double period) noexcept;

}  // namespace sidestep
