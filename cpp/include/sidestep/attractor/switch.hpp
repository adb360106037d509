#pragma once

#include <Eigen/Core>
#include <variant>

namespace sidestep {

// How the harmonic acceleration h and the geodesic acceleration g are combined, joint by joint.

/// a = h + g (T2.12).
struct Unswitched {};

/// a = h: the damped spring alone, in the curved metric (T5.1 where there is no embedding).
struct HarmonicOnly {};

/// a = g: free fall along a geodesic (T5.3). It knows no goal.
struct GeodesicOnly {};

/// a = s h + (1 − s) g with s = 1 where ψ ≤ threshold, else 0 (T5.5, T5.6). ψ is the sum of all coordinates.
struct BinarySwitch {
  double threshold;
};

/// The same with s = 1 − 1 / (1 + exp(−slope (ψ − threshold))) (6.1.1).
struct SigmoidSwitch {
  double threshold;
  double slope;
};

/// The same for each joint i, with s_i = 1 / (1 + exp(−slope (d_i − threshold_i))) (T6.1, T6.2), where d_i [m] is the
/// smallest distance between the obstacles and the Gaussian means on the link that joint i carries.
struct DistanceSwitch {
  Eigen::VectorXd thresholds;  ///< Distances where the switch is half [m].
  double slope;                ///< Steepness of the switch [1/m].
};

using Switch = std::variant<Unswitched, HarmonicOnly, GeodesicOnly, BinarySwitch, SigmoidSwitch, DistanceSwitch>;

}  // namespace sidestep
