#pragma once

#include <Eigen/Core>
#include <limits>

#include "sidestep/embedding/clearances.hpp"
#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

struct SpeedRegulatorSettings {
  /// Joint speeds are held below this fraction of their limits [-]. What is left is for the bounds behind it.
  double joint_fraction = 0.9;
  /// How quickly the limit is approached [1/s]; see below.
  double rate = 10.0;
  /// Speed and separation: the motion of the arm may shrink a clearance h by at most
  /// closing_speed + closing_slope max(h, 0) [m/s; 1/s], for what is within the reach of its barrier. Infinite: no such
  /// limit.
  double closing_speed = std::numeric_limits<double>::infinity();
  double closing_slope = 1.0;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

/// Regulates the speed along a motion: an acceleration β v, with β <= 0, that leaves the path of a geodesic as it is.
///
/// Why the path stays. Along a geodesic q̈ = −Γ(q)(v, v), of degree 2 in v. Put q(t) = p(σ(t)): then v = σ̇ p', and if p
/// is a geodesic, q̈ = σ̇² p'' + σ̈ p' = −Γ(v, v) + (σ̈/σ̇) v. So β = σ̈/σ̇ changes the clock σ, never the curve p. This is
/// true of the geodesic term alone: a spring does not scale with the speed, so with it a slower arm bends differently.
///
/// How β is found. Each limit gives a ratio of speed to allowed speed,
///     r_j = |v_j| / (fraction · limit_j),      r_k = max(0, −∇h_k·v) / (closing_speed + closing_slope h_k),
/// each of degree 1 in v, and so is their smooth maximum ρ = (Σ r^8)^(1/8) >= max r. Hence ∂ρ/∂v · v = ρ, and
///     dρ/dt = (dρ/dt without β) + β ρ.
/// β is the value nearest to zero with dρ/dt <= rate (1 − ρ)/min(ρ, 1), and never positive. ρ then stays below 1, or comes back
/// to it with time constant 1/rate, β is continuous, and at low speed it is zero whatever the acceleration.
///
/// With obstacles that move, dρ/dt takes ∇h·v as if they stood still for its own sake, but all of d²h/dt².
class SpeedRegulator {
 public:
  /// Throws std::invalid_argument if the settings are not valid.
  explicit SpeedRegulator(SpeedRegulatorSettings settings = {});

  struct Result {
    double ratio;  ///< ρ; at most 1 within the limits
    double drag;   ///< β [1/s], at most 0
  };

  /// At velocity v and acceleration a without regulation (nv each). No allocation.
  Result operator()(ConstVectorRef v, ConstVectorRef a,
                    const JointLimits& limits, const Clearances& clearances) const noexcept;

  const SpeedRegulatorSettings& settings() const noexcept { return settings_; }

 private:
  SpeedRegulatorSettings settings_;
};

}  // namespace sidestep
