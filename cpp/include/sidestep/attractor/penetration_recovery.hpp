#pragma once

#include <Eigen/Core>

#include "sidestep/clearance/clearances.hpp"
#include "sidestep/attractor/one_sided_metric.hpp"

namespace sidestep {

// Recovery of an arm that is inside a barrier, because an obstacle appeared on it or jumped.
//
// Geodesics do not bring it out: at rest the geodesic term is zero, and below its floor a barrier is linear in h, so it keeps
// dh/dt. Nor does the goal, whose attraction along ∇h is divided by 1 + ψ'² |∇h|², about 1e10. Three things are added.
//
// 1. A push. For each clearance h below its floor, with its depth d = floor − h > 0 and the weight w = smoothstep(d / margin),
//    zero with its derivative at the floor and one at full margin,
//        the wanted d²h/dt² is   w · rate · max(speed − dh/dt, 0),
//    which makes h grow with `speed` and never holds back an arm that leaves faster. Its acceleration along ∇h,
//        u_k ∇h_k / (|∇h_k|² + ε),        ε > 0: bounded where the joints can hardly change h,
//    is averaged over the clearances inside (the ellipsoids of one link push the same way, and their pushes must not add up).
//    Only barriers that the push would drive the arm into bend it: it goes through the one-sided metric
//    (one_sided_metric.hpp).
//
// 2. No rebound. A geodesic keeps its energy ½ (|v|² + |dψ/dt|²). Leaving a barrier of slope ψ' = 1e5 at 1 cm/s is an energy of
//    5e5, which becomes joint speed as the slope falls. An arm that moves by itself has no such dψ/dt, but one that is pushed
//    out has, and so has one from which an obstacle recedes. So in the geodesic term a coordinate whose clearance grows is
//    scaled, ψ → s ψ, with s = rebound / |dψ/dt| if that is below 1. Of its curvature ψ' h'' + ψ'' h'² the second term, which
//    gives the speed back, is scaled by another s² (s alone would add energy in every step, as s grows while the arm leaves).
//    Slower motions among obstacles at rest do not change.
//
// 3. Fading. Several barriers around the arm would each keep their dh/dt: rigid constraints, too many for the joints. Both in
//    the geodesic term and in the metric of the push, J_k of a barrier inside is shortened to at most (1 − w_k)/w_k.
struct PenetrationRecovery {
  double speed = 0.1;     ///< Speed with which an arm leaves a barrier [m/s | rad/s].
  double rate = 20.0;     ///< Rate with which it takes up that speed [1/s]; 0: no push.
  double margin = 0.005;  ///< Depth below the floor at which the push is full [m | rad].
  double rebound = 1.0;   ///< Largest joint speed that a barrier gives back [rad/s].

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

/// The push, and the memory it needs.
class PenetrationRecoveryWorkspace {
 public:
  PenetrationRecoveryWorkspace(int nv, int m);

  /// Writes the push (nv) for clearances (m) with these floors; zero if none is below its floor. Returns the coordinate deepest
  /// below its floor; -1: none. No allocation.
  int update(const PenetrationRecovery& settings, const Eigen::VectorXd& floors, const Clearances& clearances,
             const Eigen::MatrixXd& jacobian_transposed, Eigen::VectorXd& push) noexcept;

  /// Writes G⁻¹ Jᵀ c (nv) with the coordinates scaled as in 2 and 3, after `update`; `metric` is G without scaling and
  /// serves where there is none. No allocation.
  void solve_pullback(const PenetrationRecovery& settings, const Clearances& clearances,
                      const Eigen::MatrixXd& jacobian_transposed, const Eigen::VectorXd& curvatures, GraphMetric& metric,
                      Eigen::VectorXd& result) noexcept;

 private:
  GraphMetric metric_;
  OneSidedMetric one_sided_;
  Eigen::MatrixXd jacobian_transposed_;  // Scaled gradients, as columns.
  Eigen::VectorXd fades_;                // Lengths to which J_k is shortened inside, else 1 (m).
  Eigen::VectorXd curvatures_;           // Scaled curvatures (m).
};

}  // namespace sidestep
