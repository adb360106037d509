#include "sidestep/kinematics/kinematic_state.hpp"

#include <cmath>

namespace sidestep {

KinematicState::KinematicState(const Robot& robot)
    : q_(robot.num_coordinates()), v_(robot.num_coordinates()), links_(robot.joints().size()) {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Joint& joint = robot.joints()[i];
    links_[i].parent = joint.parent;
    links_[i].coordinate = joint.coordinate;
    const Eigen::Vector3d& a = joint.axis;
    const Eigen::Matrix3d R_PJ = joint.X_PJ.linear();
    Eigen::Matrix3d cross;
    cross << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    rotations_.push_back({R_PJ * a * a.transpose(), R_PJ - R_PJ * a * a.transpose(), R_PJ * cross});
  }
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(robot.num_coordinates());
  update(robot, zero, zero);
}

void KinematicState::update(const Robot& robot, Eigen::Ref<const Eigen::VectorXd> q,
                            Eigen::Ref<const Eigen::VectorXd> v) noexcept {
  static const Link base{-1, -1, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), {}, {}, {}};
  q_ = q;
  v_ = v;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Joint& joint = robot.joints()[i];
    const Link& parent = joint.parent < 0 ? base : links_[static_cast<std::size_t>(joint.parent)];
    Link& link = links_[i];
    const double position = joint.multiplier * q[joint.coordinate] + joint.offset;
    const double velocity = v[joint.coordinate];

    const Eigen::Vector3d p_WJ = parent.p_WL + parent.R_WL * joint.X_PJ.translation();
    if (joint.type == JointType::revolute) {
      const Rotation& rotation = rotations_[i];
      const Eigen::Matrix3d R_PL =
          rotation.fixed + std::cos(position) * rotation.cosine + std::sin(position) * rotation.sine;
      link.R_WL = parent.R_WL.lazyProduct(R_PL);
      link.p_WL = p_WJ;
      link.screw.angular = joint.multiplier * (link.R_WL * joint.axis);
      link.screw.linear = p_WJ.cross(link.screw.angular);
    } else {
      link.R_WL = parent.R_WL.lazyProduct(joint.X_PJ.linear());
      link.screw.angular.setZero();
      link.screw.linear = joint.multiplier * (link.R_WL * joint.axis);
      link.p_WL = p_WJ + position * (link.R_WL * joint.axis);
    }

    const Eigen::Vector3d joint_angular = velocity * link.screw.angular;
    const Eigen::Vector3d joint_linear = velocity * link.screw.linear;
    link.velocity.angular = parent.velocity.angular + joint_angular;
    link.velocity.linear = parent.velocity.linear + joint_linear;
    // V × (S q̇), the motion cross product, at the world origin.
    link.bias.angular = parent.bias.angular + link.velocity.angular.cross(joint_angular);
    link.bias.linear = parent.bias.linear + link.velocity.angular.cross(joint_linear) +
                       link.velocity.linear.cross(joint_angular);
  }
}

Eigen::Isometry3d frame_pose(const Robot& robot, const KinematicState& state, int frame) {
  const Frame& f = robot.frames().at(static_cast<std::size_t>(frame));
  if (f.joint < 0) {
    return f.X_JF;
  }
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
  X_WL.linear() = state.link(f.joint).R_WL;
  X_WL.translation() = state.link(f.joint).p_WL;
  return X_WL * f.X_JF;
}

Eigen::MatrixXd frame_jacobian(const Robot& robot, const KinematicState& state, int frame) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, robot.num_coordinates());
  const Eigen::Vector3d p = frame_pose(robot, state, frame).translation();
  for (int j = robot.frames().at(static_cast<std::size_t>(frame)).joint; j >= 0;
       j = robot.joints()[static_cast<std::size_t>(j)].parent) {
    const SpatialMotion& screw = state.link(j).screw;
    const int column = robot.joints()[static_cast<std::size_t>(j)].coordinate;
    jacobian.col(column).head<3>() += screw.linear + screw.angular.cross(p);
    jacobian.col(column).tail<3>() += screw.angular;
  }
  return jacobian;
}

Vector6d frame_bias_acceleration(const Robot& robot, const KinematicState& state, int frame) {
  Vector6d acceleration = Vector6d::Zero();
  const int joint = robot.frames().at(static_cast<std::size_t>(frame)).joint;
  if (joint >= 0) {
    const KinematicState::Link& link = state.link(joint);
    const Eigen::Vector3d p = frame_pose(robot, state, frame).translation();
    const Eigen::Vector3d p_dot = link.velocity.linear + link.velocity.angular.cross(p);
    acceleration.head<3>() = link.bias.linear + link.bias.angular.cross(p) + link.velocity.angular.cross(p_dot);
    acceleration.tail<3>() = link.bias.angular;
  }
  return acceleration;
}

void accumulate_generalised_force(const KinematicState& state, int joint, const SpatialForce& wrench,
                                  Eigen::Ref<Eigen::VectorXd> generalised_force) noexcept {
  for (int j = joint; j >= 0; j = state.link(j).parent) {
    const KinematicState::Link& link = state.link(j);
    generalised_force[link.coordinate] +=
        link.screw.angular.dot(wrench.angular) + link.screw.linear.dot(wrench.linear);
  }
}

}  // namespace sidestep
