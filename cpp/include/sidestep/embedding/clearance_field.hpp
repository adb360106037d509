#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/embedding/body_ellipsoid.hpp"
#include "sidestep/embedding/clearances.hpp"
#include "sidestep/kinematics/kinematic_state.hpp"
#include "sidestep/obstacles/obstacles.hpp"

namespace sidestep {

/// Clearance between the calibrated ellipsoids of a body and obstacle points, one per Gaussian.
///
/// An ellipsoid is {y : (y − μ)ᵀ S⁻¹ (y − μ) ≤ 1}. With e = y − μ, u = S⁻¹ e, m = e·u the clearance of a point is
///
///     h(y) = (m − √m) / |u| − r,
///
/// the first-order distance of √m, less the point's radius. Because √m is convex it never exceeds the distance to the
/// ellipsoid; it has the right zero set, is exact along the axes and exact everywhere for spheres.
///
/// The points are reduced to one clearance by the Boltzmann mean (see boltzmann_mean.hpp), so that the result does not
/// depend on how densely a surface is sampled. Points that do not matter are left out in groups: by Kantorovich's
/// inequality u·e ≥ |u| |e| 2s/(1 + s²) with s the shortest over the longest semi-axis a, so outside the ellipsoid
/// h ≥ (|e| − a) 2s/(1 + s²) − r. The others are taken side by side, with the widest registers of the machine.
class ClearanceField {
 public:
  /// Throws std::invalid_argument if the body is not calibrated, has an unknown link or nothing that moves, or the
  /// temperature is not positive and finite.
  ClearanceField(const Robot& robot, const Body& body, double temperature = 0.002);

  int size() const noexcept { return static_cast<int>(ellipsoids_.size()); }

  /// Writes the clearances below `reach` [m] at a state into `out`, which the caller has cleared. No allocation.
  void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach,
                ClearanceView out) const noexcept;

  /// Which component of the body ellipsoid k came from.
  int component(int k) const noexcept { return ellipsoids_[static_cast<std::size_t>(k)].body.component; }

 private:
  struct Ellipsoid {
    BodyEllipsoid body;
    Eigen::Matrix3d axes_T;      // rotates into the principal axes
    Eigen::Vector3d precisions;  // 1 / semi-axis², along them
    double steepness;            // h ≥ steepness (|y − μ| − extent) − r outside
  };
  /// Consecutive ellipsoids of one joint, with a ball around them in the frame of its child.
  struct Cluster {
    int first, size;
    Eigen::Vector3d centre;
    double radius, steepness;  // the least
  };

  double temperature_;
  std::vector<Ellipsoid> ellipsoids_;  // those of one joint stand together
  std::vector<Cluster> clusters_;
};

}  // namespace sidestep
