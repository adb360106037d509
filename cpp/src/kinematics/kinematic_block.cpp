#include "sidestep/kinematics/kinematic_block.hpp"

#include "joint_models.hpp"
#include "kernels/in_use.hpp"

namespace sidestep {
namespace {

static_assert(block_states == kernels::most_lanes);

kernels::UpdateLinkBlock update_link_block() noexcept {
  return SIDESTEP_KERNEL_IN_USE(kernels::update_link_block);
}

}  // namespace

struct KinematicBlock::Joints {
  std::vector<kernels::JointModel> models;
};

KinematicBlock::KinematicBlock(const Robot& robot)
    : q_(static_cast<std::size_t>(robot.num_coordinates())),
      v_(q_),
      links_(robot.joints().size() * kernels::link_numbers + 1),
      joints_(std::make_shared<Joints>(Joints{joint_models(robot)})) {
  for (const Joint& joint : robot.joints()) {
    parents_.push_back(joint.parent);
    coordinates_.push_back(joint.coordinate);
  }
  update(q_, v_);
}

void KinematicBlock::update(const std::vector<BlockRow>& q, const std::vector<BlockRow>& v) noexcept {
  q_ = q;
  v_ = v;
  if (!parents_.empty()) {
    update_link_block()(joints_->models.data(), static_cast<int>(parents_.size()), q_.front().of, v_.front().of,
                        links_.front().of);
  }
}

}  // namespace sidestep
