#include "sidestep/kinematics/kinematic_state.hpp"

#include <cstddef>
#include <type_traits>

#include "kernels/kinematics_kernel.hpp"
#include "sidestep/kinematics/instruction_set.hpp"

namespace sidestep {
namespace {

using Link = KinematicState::Link;

// The inner loop writes a link as consecutive numbers.
constexpr std::size_t number_at(int i) { return offsetof(Link, R_WL) + static_cast<std::size_t>(i) * sizeof(double); }
static_assert(std::is_standard_layout_v<Link> && sizeof(Link) % sizeof(double) == 0);
static_assert(offsetof(Link, p_WL) == number_at(kernels::position_at));
static_assert(offsetof(Link, screw) == number_at(kernels::screw_at));
static_assert(offsetof(Link, velocity) == number_at(kernels::velocity_at));
static_assert(offsetof(Link, bias) == number_at(kernels::bias_at));
static_assert(sizeof(Link) >= number_at(kernels::link_numbers));

kernels::UpdateLinks update_links() noexcept {
#if defined(SIDESTEP_X86_KERNELS)
  if (instruction_set() >= InstructionSet::avx2) {
    return kernels::update_links_avx2;
  }
#endif
  return kernels::update_links_baseline;
}

void set(double (&column)[4], const Eigen::Vector3d& v) { Eigen::Map<Eigen::Vector4d>(column) << v, 0.0; }

/// A revolute joint turns by R_PJ exp(θ [a]×) = R_PJ B exp(θ [e_z]×) Bᵀ for a rotation B with B e_z = a.
kernels::JointModel model_of(const Joint& joint) {
  const Eigen::Vector3d& a = joint.axis;
  Eigen::Matrix3d B;
  B << Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), a;
  const bool straight = a == Eigen::Vector3d::UnitZ();
  if (!straight) {
    B.col(0) = a.unitOrthogonal();
    B.col(1) = a.cross(B.col(0));
  }
  const Eigen::Matrix3d axes = joint.X_PJ.linear() * B;
  kernels::JointModel model{};
  set(model.x, axes.col(0));
  set(model.y, axes.col(1));
  set(model.axis, axes.col(2));
  set(model.translation, joint.X_PJ.translation());
  for (int k = 0; k < 3; ++k) {
    set(model.child[k], B.row(k));
  }
  model.multiplier = joint.multiplier;
  model.offset = joint.offset;
  model.coordinate = joint.coordinate;
  model.parent = joint.parent;
  model.slides = joint.type == JointType::prismatic;
  model.straight = straight;
  return model;
}

}  // namespace

struct KinematicState::Joints {
  std::vector<kernels::JointModel> models;
};

KinematicState::KinematicState(const Robot& robot)
    : q_(robot.num_coordinates()), v_(robot.num_coordinates()), links_(robot.joints().size()) {
  auto joints = std::make_shared<Joints>();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Joint& joint = robot.joints()[i];
    links_[i].parent = joint.parent;
    links_[i].coordinate = joint.coordinate;
    joints->models.push_back(model_of(joint));
  }
  constexpr std::size_t block = kernels::joint_block;
  joints->models.resize((links_.size() + block - 1) / block * block);
  joints_ = std::move(joints);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(robot.num_coordinates());
  update(robot, zero, zero);
}

void KinematicState::update(const Robot& robot, ConstVectorRef q,
                            ConstVectorRef v) noexcept {
  with_size(robot.num_coordinates(), [&](auto nv) {
    sized(q_, nv) = sized(q, nv);
    sized(v_, nv) = sized(v, nv);
  });
  if (!links_.empty()) {
    update_links()(joints_->models.data(), num_links(), q_.data(), v_.data(), links_.front().R_WL.data(),
                   static_cast<int>(sizeof(Link) / sizeof(double)));
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
