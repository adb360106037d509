#include "joint_models.hpp"

#include <cstddef>

namespace sidestep {
namespace {

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

std::vector<kernels::JointModel> joint_models(const Robot& robot) {
  std::vector<kernels::JointModel> models;
  for (const Joint& joint : robot.joints()) {
    models.push_back(model_of(joint));
  }
  constexpr std::size_t block = kernels::joint_block;
  models.resize((models.size() + block - 1) / block * block);
  return models;
}

}  // namespace sidestep
