#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/embedding/clearances.hpp"
#include "sidestep/kinematics/kinematic_state.hpp"
#include "sidestep/obstacles/obstacles.hpp"

namespace sidestep {

/// Clearance between the calibrated ellipsoids of a body and obstacle points, one per Gaussian.
///
/// An ellipsoid is {y : (y − μ)ᵀ Σ⁻¹ (y − μ) ≤ c}. With e = y − μ, u = Σ⁻¹ e, m = e·u the clearance of a point is
///
///     h(y) = (m − √(c m)) / |u| − r,
///
/// the first-order distance of √m, less the point's radius. Because √m is convex it never exceeds the distance to the
/// ellipsoid; it has the right zero set, is exact along the axes and exact everywhere for spheres.
///
/// The points are reduced to one clearance by the Boltzmann mean (see boltzmann_mean.hpp), so that the result does not
/// depend on how densely a surface is sampled.
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
  int component(int k) const noexcept { return ellipsoids_[static_cast<std::size_t>(k)].component; }

 private:
  struct Ellipsoid {
    int joint;
    int component;
    Eigen::Vector3d mean;        // in the frame of the joint's child
    Eigen::Matrix3d axes_T;      // rotates into the principal axes
    Eigen::Vector3d precisions;  // along them, of Σ⁻¹
    double root_level;           // √c
    double slimness;             // shortest / longest semi-axis
    double extent;               // longest semi-axis
  };

  double temperature_;
  std::vector<Ellipsoid> ellipsoids_;  // those of one joint stand together
};

}  // namespace sidestep
