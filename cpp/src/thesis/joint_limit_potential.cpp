#include "sidestep/thesis/joint_limit_potential.hpp"

#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {

JointLimitPotential::JointLimitPotential(const Robot& robot, double slope, double height)
    : Embedding(robot), lower_(robot.limits().lower), upper_(robot.limits().upper), slope_(slope), height_(height) {
  require(slope > 0.0 && slope < infinity, "joint limit potential: slope", slope, "positive and finite");
  require(height > 0.0 && height < infinity, "joint limit potential: height", height, "positive and finite");
}

void JointLimitPotential::add_to(EmbeddingView out, const KinematicState& state,
                                 const Obstacles& /*obstacles*/) const noexcept {
  // An infinite limit gives exp(inf): s = 0, and both derivatives 0.
  const auto sigmoid = [](double u) { return 1.0 / (1.0 + std::exp(-u)); };
  for (Eigen::Index j = 0; j < lower_.size(); ++j) {
    const double above = sigmoid(slope_ * (state.q()[j] - upper_[j]));
    const double below = sigmoid(slope_ * (lower_[j] - state.q()[j]));
    const double first_above = above * (1.0 - above);
    const double first_below = below * (1.0 - below);
    const double speed = slope_ * state.v()[j];
    out.values[0] += height_ * (above + below);
    out.jacobian_transposed(j, 0) += height_ * slope_ * (first_above - first_below);
    out.curvatures[0] += height_ * speed * speed * (first_above * (1.0 - 2.0 * above) + first_below * (1.0 - 2.0 * below));
  }
}

}  // namespace sidestep
