#include "sidestep/embedding/joint_limit_potential.hpp"

#include <cmath>

#include "../settings.hpp"

namespace sidestep {

JointLimitPotential::JointLimitPotential(const Robot& robot, double slope, double height)
    : Embedding(robot), lower_(robot.limits().lower), upper_(robot.limits().upper), slope_(slope), height_(height) {
  require(slope > 0.0 && slope < infinity, "joint limit potential: slope", slope, "positive and finite");
  require(height > 0.0 && height < infinity, "joint limit potential: height", height, "positive and finite");
}

void JointLimitPotential::add_joint(Eigen::Index j, double q, double v, double& value, double& slope,
                                    double& curvature) const noexcept {
  // An infinite limit gives exp(inf): s = 0, and both derivatives 0.
  const auto sigmoid = [](double u) { return 1.0 / (1.0 + std::exp(-u)); };
  const double above = sigmoid(slope_ * (q - upper_[j]));
  const double below = sigmoid(slope_ * (lower_[j] - q));
  const double first_above = above * (1.0 - above);
  const double first_below = below * (1.0 - below);
  const double speed = slope_ * v;
  value += height_ * (above + below);
  slope += height_ * slope_ * (first_above - first_below);
  curvature += height_ * speed * speed * (first_above * (1.0 - 2.0 * above) + first_below * (1.0 - 2.0 * below));
}

void JointLimitPotential::add_to(EmbeddingView out, const KinematicState& state,
                                 const Obstacles& /*obstacles*/) const noexcept {
  for (Eigen::Index j = 0; j < lower_.size(); ++j) {
    add_joint(j, state.q()[j], state.v()[j], out.values[0], out.jacobian_transposed(j, 0), out.curvatures[0]);
  }
}

void JointLimitPotential::add_block(EmbeddingBlock& out, const KinematicBlock& states,
                                    const Obstacles& /*obstacles*/) const noexcept {
  for (Eigen::Index j = 0; j < lower_.size(); ++j) {
    const auto row = static_cast<std::size_t>(j);
    for (int k = 0; k < block_states; ++k) {
      add_joint(j, states.q()[row].of[k], states.v()[row].of[k], out.value.of[k], out.gradient[row].of[k],
                out.curvature.of[k]);
    }
  }
}

}  // namespace sidestep
