#pragma once

#include <Eigen/Core>
#include <vector>

#include "closing_estimate.hpp"
#include "input.hpp"
#include "joint_kinds.hpp"
#include "sidestep/clearance/clearances.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Jacobian of a frame, transposed (nv × 6): linear, then angular.
using FrameJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// Clearances of the reference in the last step, at the velocity v there, and what closes beside the velocities that were told.
struct NearReference {
  const Clearances& clearances;
  const Eigen::VectorXd& v;
  const ClosingEstimate& closing;
};

/// Bounds that joint limits and clearances set to a velocity: ±v_j ≤ 3 (distance to the limit), ∇h·v ≥ −6 (h − margin).
///
/// Those that the wanted velocity does not keep are held, the worst first: v = v_h + P v_w, where P projects on what the held
/// directions leave free. No allocation after construction.
class VelocityBounds {
 public:
  VelocityBounds(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings,
                 const std::vector<Eigen::Index>& clearances);

  /// A bound that a velocity does not keep: g·v ≥ least, or of a joint ±v ≤ most.
  struct Bound {
    Eigen::Index joint = -1, clearance = -1;
    double excess = 0.0, least = 0.0, length = 1.0;
  };

  /// Nothing is held. `projected`: a Jacobian to be projected on what is free; empty for none.
  void release_all() noexcept;
  /// How fast joint j at position `at` may move on towards its limit [rad/s | m/s].
  double largest_speed(Eigen::Index j, double at, bool up) const noexcept;
  Bound find_worst(const Eigen::VectorXd& wanted, const Eigen::VectorXd& q, const NearReference& near, bool clearances,
                   bool joints) const noexcept;
  /// Holds a bound as direction number `held`, and projects it out of `projected`; false where those held leave nothing of it.
  bool hold(const Bound& bound, const NearReference& near, Eigen::Index held, FrameJacobian& projected) noexcept;
  /// Holds the worst of all.
  bool hold_worst(const Eigen::VectorXd& wanted, const Eigen::VectorXd& q, const NearReference& near, Eigen::Index held,
                  FrameJacobian& projected) noexcept;
  /// Writes the velocity nearest to `velocity` that keeps the bounds, as far as they can be held.
  void keep(const Eigen::VectorXd& velocity, const Eigen::VectorXd& q, const NearReference& near, Eigen::VectorXd& wanted,
            FrameJacobian& projected) noexcept;
  /// Forgets which bound was held first.
  void begin() noexcept { first_ = First{}; }

  Eigen::Index max_held() const noexcept { return held_.cols(); }
  /// Velocity that the held bounds ask for.
  const Eigen::VectorXd& held_velocity() const noexcept { return held_v_; }

  /// The bound that was held first since `begin`; -1: none.
  struct First {
    Eigen::Index clearance = -1, joint = -1;
    bool upper = false;  // the joint's upper limit
  };
  const First& first() const noexcept { return first_; }

 private:
  const Robot& robot_;
  const JointKinds& joints_;
  const ControllerSettings& settings_;
  const std::vector<Eigen::Index>& clearances_;  // coordinates in metres
  Eigen::VectorXd held_v_;
  Eigen::MatrixXd held_;  // directions, orthonormal (nv × most)
  First first_;
};

}  // namespace sidestep
