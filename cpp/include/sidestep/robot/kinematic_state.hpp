#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A spatial motion or its time derivative, taken at the world origin and expressed in the world:
/// the body-fixed point now at x moves with `linear + angular × x`.
struct SpatialMotion {
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
};

/// A wrench (or any covector on spatial motions) about the world origin, expressed in the world.
struct SpatialForce {
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
};

/// Pose, velocity and bias acceleration of every joint's child at (q, v).
///
/// Mutable workspace, allocated once. `bias` is the time derivative of the spatial velocity when q̈ = 0
/// (Featherstone 2008, eq. 5.14, at the world origin):
///     V_i = V_p + S_i q̇_i,   A_i = A_p + V_i × (S_i q̇_i).
class KinematicState {
 public:
  explicit KinematicState(const Robot& robot);

  /// Computes everything at (q, v); q and v have `robot.num_coordinates()` entries. No allocation.
  void update(const Robot& robot, ConstVectorRef q, ConstVectorRef v) noexcept;

  struct alignas(64) Link {
    int parent;            ///< Index of the parent joint; -1 for the base.
    int coordinate;        ///< Entry of q that drives the joint.
    Eigen::Matrix3d R_WL;  ///< Orientation in the world.
    Eigen::Vector3d p_WL;  ///< Origin in the world [m].
    SpatialMotion screw;   ///< Column of the Jacobian of this joint's own coordinate (multiplier included).
    SpatialMotion velocity;
    SpatialMotion bias;
    double unused = 0.0;  ///< Padding that inner loops may overwrite.

    /// The numbers from R_WL (by columns) to bias, one after the other, as inner loops read and write them.
    const double* numbers() const noexcept { return R_WL.data(); }
    /// Those of the screw.
    const double* screw_numbers() const noexcept { return screw.angular.data(); }
  };
  const Eigen::VectorXd& q() const noexcept { return q_; }
  const Eigen::VectorXd& v() const noexcept { return v_; }
  const Link& link(int joint) const noexcept { return links_[static_cast<std::size_t>(joint)]; }
  int num_links() const noexcept { return static_cast<int>(links_.size()); }

 private:
  struct Joints;  // Constants of the joints, as the inner loop reads them.

  Eigen::VectorXd q_, v_;
  std::vector<Link> links_;
  std::shared_ptr<const Joints> joints_;
};

/// Pose X_WF of a frame.
Eigen::Isometry3d frame_pose(const Robot& robot, const KinematicState& state, int frame);
Eigen::Isometry3d frame_pose(const KinematicState& state, const Frame& frame);

/// Jacobian (6 × nv) of a frame: rows 0–2 the velocity of the frame's origin [m/s], rows 3–5 the angular
/// velocity [rad/s], both expressed in the world.
Eigen::MatrixXd frame_jacobian(const Robot& robot, const KinematicState& state, int frame);
Eigen::MatrixXd frame_jacobian(const Robot& robot, const KinematicState& state, const Frame& frame);

/// J̇ v (6) of a frame, in the rows' order of `frame_jacobian`: its acceleration when q̈ = 0.
Vector6d frame_bias_acceleration(const Robot& robot, const KinematicState& state, int frame);

/// Projects a wrench on link `joint` to the joint coordinates: generalised_force += J_jointᵀ wrench.
void accumulate_generalised_force(const KinematicState& state, int joint, const SpatialForce& wrench,
                                  Eigen::Ref<Eigen::VectorXd> generalised_force) noexcept;

/// The same for wrenches on one link, each to a force of its own (nv): they go down to the base together.
template <std::size_t num>
void accumulate_generalised_forces(const KinematicState& state, int joint, const std::array<SpatialForce, num>& wrenches,
                                   const std::array<double*, num>& generalised_forces) noexcept {
  std::array<Vector6d, num> both;
  for (std::size_t n = 0; n < num; ++n) {
    both[n] << wrenches[n].angular, wrenches[n].linear;
  }
  for (int j = joint; j >= 0; j = state.link(j).parent) {
    const KinematicState::Link& link = state.link(j);
    for (std::size_t n = 0; n < num; ++n) {
      generalised_forces[n][link.coordinate] += Eigen::Map<const Vector6d>(link.screw_numbers()).dot(both[n]);
    }
  }
}

/// The same for wrenches on many links, from the last joint to the first: those of a chain go down to the base
/// together.
class GeneralisedForce {
 public:
  /// Adds to `generalised_force` (nv), which must outlive this.
  GeneralisedForce(const KinematicState& state, Eigen::Ref<Eigen::VectorXd> generalised_force) noexcept
      : state_(state), force_(generalised_force.data()) {}

  /// A wrench about the world origin, its moment first; `joint` is not after those before.
  void add(int joint, const Vector6d& wrench) noexcept {
    go_down_to(joint);
    if (joint_ != joint) {  // on another branch, or the first
      go_down_to(-1);
      joint_ = joint;
      wrench_ = wrench;
    } else {
      wrench_ += wrench;
    }
  }
  /// To be called once, after all.
  void finish() noexcept { go_down_to(-1); }

 private:
  void go_down_to(int joint) noexcept {
    while (joint_ > joint) {
      const KinematicState::Link& link = state_.link(joint_);
      force_[link.coordinate] += Eigen::Map<const Vector6d>(link.screw_numbers()).dot(wrench_);
      joint_ = link.parent;
    }
  }

  const KinematicState& state_;
  double* force_;
  Vector6d wrench_ = Vector6d::Zero();
  int joint_ = -1;
};

}  // namespace sidestep
