#include "sidestep/robot/kinematic_state.hpp"

#include <cstddef>
#include <type_traits>

#include "joint_models.hpp"
#include "sidestep/math/instruction_set.hpp"

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

}  // namespace

struct KinematicState::Joints {
  std::vector<kernels::JointModel> models;
};

KinematicState::KinematicState(const Robot& robot)
    : q_(robot.num_coordinates()), v_(robot.num_coordinates()), links_(robot.joints().size()) {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Joint& joint = robot.joints()[i];
    links_[i].parent = joint.parent;
    links_[i].coordinate = joint.coordinate;
  }
  joints_ = std::make_shared<Joints>(Joints{joint_models(robot)});
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(robot.num_coordinates());
  update(robot, zero, zero);
}

void KinematicState::update(const Robot& robot, ConstVectorRef q, ConstVectorRef v) noexcept {
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
  return frame_pose(state, robot.frames().at(static_cast<std::size_t>(frame)));
}

Eigen::Isometry3d frame_pose(const KinematicState& state, const Frame& f) {
  if (f.joint < 0) {
    return f.X_JF;
  }
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
  X_WL.linear() = state.link(f.joint).R_WL;
  X_WL.translation() = state.link(f.joint).p_WL;
  return X_WL * f.X_JF;
}

Eigen::MatrixXd frame_jacobian(const Robot& robot, const KinematicState& state, int frame) {
  return frame_jacobian(robot, state, robot.frames().at(static_cast<std::size_t>(frame)));
}

Eigen::MatrixXd frame_jacobian(const Robot& robot, const KinematicState& state, const Frame& frame) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, robot.num_coordinates());
  const Eigen::Vector3d p = frame_pose(state, frame).translation();
  for (int j = frame.joint; j >= 0; j = robot.joints()[static_cast<std::size_t>(j)].parent) {
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
  accumulate_generalised_forces<1>(state, joint, {wrench}, {generalised_force.data()});
}

}  // namespace sidestep
