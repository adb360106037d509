#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Mass properties of a rigid body, in the frame of that body.
struct Inertial {
  double mass = 0.0;                                  ///< Mass [kg].
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      ///< Centre of mass [m].
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< Rotational inertia about the centre of mass [kg m^2].

  /// Throws std::invalid_argument that names `owner` and the quantity at fault. The mass is not negative; the
  /// rotational inertia is symmetric and positive semidefinite.
  void validate(const std::string& owner) const;
};

/// Sums the inertias of the links that move with each joint: one per joint, in the frame of the joint's child.
///
/// `links` holds one inertia per frame of the robot, in that frame. Links fixed to the world do not count.
/// Throws std::invalid_argument on a wrong number or an invalid inertia.
std::vector<Inertial> fold_inertials(const Robot& robot, const std::vector<Inertial>& links);

/// Earth's gravity along the world's -z [m/s^2].
inline const Eigen::Vector3d standard_gravity{0.0, 0.0, -9.81};

/// The equation of motion M(q) a + h(q, v) = τ of a robot's tree, without friction and rotor inertia.
///
/// The mass matrix is found by composite rigid bodies and the bias h = C(q, v) v + g(q) by recursive Newton-Euler, both
/// in world coordinates. Joints that share a coordinate (mimic joints) are projected onto it by their screws.
/// Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 and 6.
class RigidBodyDynamics {
 public:
  /// `inertials`: one per joint, in the frame of the joint's child. Throws std::invalid_argument on a wrong number, an
  /// invalid inertia or a gravity that is not finite.
  RigidBodyDynamics(Robot robot, std::vector<Inertial> inertials, const Eigen::Vector3d& gravity = standard_gravity);

  /// Memory of the recursions, allocated once. One per thread.
  class Workspace {
   public:
    explicit Workspace(const RigidBodyDynamics& dynamics);

   private:
    friend class RigidBodyDynamics;
    /// Mass, first and second moment of a body with all that it carries, about the world origin.
    struct CompositeBody {
      double mass;
      Eigen::Vector3d first;
      Eigen::Matrix3d second;
    };
    KinematicState state_;
    std::vector<CompositeBody> composites_;
    std::vector<SpatialForce> forces_;
    Eigen::VectorXd rest_;
  };

  const Robot& robot() const noexcept { return robot_; }
  const std::vector<Inertial>& inertials() const noexcept { return inertials_; }
  const Eigen::Vector3d& gravity() const noexcept { return gravity_; }

  /// M (nv × nv) at q. No allocation.
  void mass_matrix(ConstVectorRef q, Workspace& workspace, Eigen::Ref<Eigen::MatrixXd> mass) const noexcept;
  /// h (nv) [Nm | N] at (q, v). No allocation.
  void bias(ConstVectorRef q, ConstVectorRef v, Workspace& workspace, Eigen::Ref<Eigen::VectorXd> force) const noexcept;

  /// The same from a state of this robot that is up to date.
  void mass_matrix(const KinematicState& state, Workspace& workspace, Eigen::Ref<Eigen::MatrixXd> mass) const noexcept;
  void bias(const KinematicState& state, Workspace& workspace, Eigen::Ref<Eigen::VectorXd> force) const noexcept;
  /// Gravity part of the bias, g (nv) [Nm | N]. No allocation.
  void gravity(const KinematicState& state, Workspace& workspace, Eigen::Ref<Eigen::VectorXd> force) const noexcept;

 private:
  /// Projects the bodies' forces, summed along the tree, onto the coordinates.
  void project(const KinematicState& state, Workspace& workspace, Eigen::Ref<Eigen::VectorXd> force) const noexcept;

  Robot robot_;
  std::vector<Inertial> inertials_;
  Eigen::Vector3d gravity_;
};

}  // namespace sidestep
