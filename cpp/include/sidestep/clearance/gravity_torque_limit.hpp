#pragma once

#include <vector>

#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/robot/dynamics.hpp"

namespace sidestep {

/// Clearance between gravity torque and effort limit: the arm can rest where it is positive.
///
///     h_j(q) = (effort_j − |g_j(q)|) / weight_j  [m],
///
/// with the weight of all that joint j carries: how much farther out their centre of mass may be. (For a prismatic joint it is a
/// share of that weight.) Where h_j is negative, no controller can hold the arm, and it sinks. It is no distance to an object,
/// so Clearances::least does not contain it.
class GravityTorqueLimit final : public ClearanceGroup {
 public:
  /// Contains the joints that can come closer to their limit than an activation distance of `most` [m] in some configuration.
  /// `effort` (nv) [Nm | N] may be infinite.
  GravityTorqueLimit(const RigidBodyDynamics& dynamics, const Eigen::VectorXd& effort, double most);

  /// Load of a joint, or of several that share a coordinate.
  struct Load {
    struct Carrier {
      int joint;
      std::vector<int> carried;  // Joints that it carries, itself first.
    };
    int coordinate;
    double effort;             ///< Effort limit [Nm | N].
    double weight;             ///< Weight by which torque becomes a clearance [N].
    double activation;         ///< Activation distance [m], no longer than a tenth of effort / weight.
    Eigen::VectorXd steepest;  ///< Bounds of |∂h/∂q| (nv) [m/rad]; infinite below a prismatic joint without limits.
    Eigen::MatrixXd bend;      ///< Bounds of |∂²h/∂q²| (nv × nv) [m/rad²].
    std::vector<Carrier> carriers;
  };
  const std::vector<Load>& loads() const noexcept { return loads_; }

  int size() const noexcept override { return static_cast<int>(loads_.size()); }
  CoordinateLabel label(int k) const override;
  void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                ClearanceView out) const noexcept override;
  double longest_activation(int k) const noexcept override { return loads_[static_cast<std::size_t>(k)].activation; }

  /// h [m]; its gradient into `gradient` (nv), its rate and its curvature at q̈ = 0. No allocation.
  struct DistanceLeft {
    double value, rate, curvature;
  };
  DistanceLeft at(const Load& load, const KinematicState& state, Eigen::Ref<Eigen::VectorXd> gradient) const noexcept;
  /// h alone [m].
  double value(const Load& load, const KinematicState& state) const noexcept;

 private:
  Robot robot_;
  std::vector<Inertial> inertials_;
  Eigen::Vector3d gravity_;
  std::vector<Load> loads_;
};

}  // namespace sidestep
