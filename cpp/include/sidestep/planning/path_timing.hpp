#pragma once

#include <Eigen/Core>

#include "sidestep/planning/path_rounding.hpp"

namespace sidestep {

/// Limits of the joints along a path (nv each), all positive and finite: [rad/s], [rad/s²], [rad/s³], or in metres.
struct PathLimits {
  Eigen::VectorXd velocity, acceleration, jerk;
};

/// A motion along a path, as fast as limits allow, at samples that are `period` apart.
struct PathTiming {
  double period = 0.0;      ///< Sampling period [s].
  Eigen::MatrixXd q, v, a;  ///< Samples (nv × K).
  Eigen::VectorXd station;  ///< Stations (K), ascending.

  /// Shortest distance along the path [rad | m] in any span of this duration [s]; infinity for a shorter motion.
  double slowest(double duration) const noexcept;
};

/// The fastest motion along a path from the speed `begin` = ds/dt to rest, within the limits at every sample.
///
/// Time-optimal within velocity and acceleration by two passes over `stations` (as TOPP-RA: Pham and Pham 2018): with
/// x = (ds/dt)² and u = d²s/dt² the limits |q'_j| √x <= v_j and |q'_j u + q''_j x| <= a_j are linear; backward, the largest x
/// from which the next is reached; forward, the largest u. `fastest` bounds ds/dt at the stations (limits hold at stations;
/// in between by interpolation). u jumps, so s(t) is averaged over a window 2 max(a_j / jerk_j), which leaves the path as it
/// is. If the average or the bends of the path then exceed the acceleration or jerk limits, the share of the acceleration
/// limits is lowered there and the passes are repeated. An excess after `most_rounds` is removed by a slower clock. `share`:
/// share of the acceleration limits that may be used at each station, in (0, 1].
PathTiming time_path(const RoundedPath& path, const Eigen::VectorXd& stations, const Eigen::VectorXd& fastest,
                     const Eigen::VectorXd& share, const PathLimits& limits, double begin);

}  // namespace sidestep
