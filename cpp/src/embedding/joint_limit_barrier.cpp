#include "sidestep/embedding/joint_limit_barrier.hpp"

#include <cmath>
#include <stdexcept>

namespace sidestep {

JointLimitBarrier::JointLimitBarrier(const Robot& robot, BarrierFunction barrier)
    : Embedding(robot), barrier_(barrier) {
  barrier_.validate("joint limit barrier");
  for (int j = 0; j < robot.num_coordinates(); ++j) {
    for (const double sign : {1.0, -1.0}) {
      const double position = sign > 0.0 ? robot.limits().lower[j] : robot.limits().upper[j];
      if (std::isfinite(position)) {
        limits_.push_back({j, sign, position});
      }
    }
  }
  if (limits_.empty()) {
    throw std::invalid_argument("joint limit barrier: robot '" + robot.name() + "' has no finite position limit");
  }
}

void JointLimitBarrier::add_to(EmbeddingView out, const KinematicState& state,
                               const Obstacles& /*obstacles*/) const noexcept {
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const PositionLimit& limit = limits_[i];
    const double v = state.v()[limit.joint_coordinate];
    const auto f = barrier_(limit.sign * (state.q()[limit.joint_coordinate] - limit.position));
    out.values[k] += f.value;
    out.jacobian_transposed(limit.joint_coordinate, k) += limit.sign * f.first;
    out.curvatures[k] += f.second * v * v;
  }
}

}  // namespace sidestep
