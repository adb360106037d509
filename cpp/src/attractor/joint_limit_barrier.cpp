#include "sidestep/attractor/joint_limit_barrier.hpp"

#include <cmath>
#include <stdexcept>

namespace sidestep {

JointLimitBarrier::JointLimitBarrier(const Robot& robot, BarrierFunction barrier)
    : Barrier(robot, barrier, "joint limit barrier") {
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
  set_num_coordinates(static_cast<int>(limits_.size()));
  for (std::size_t k = 0; k < limits_.size(); ++k) {
    const int j = limits_[k].joint_coordinate;
    if (robot.is_prismatic(j)) {
      shorten_activation(static_cast<int>(k), range_share * (robot.limits().upper[j] - robot.limits().lower[j]));
    }
  }
}

void JointLimitBarrier::add_to(EmbeddingView out, const KinematicState& state, const Obstacles& /*obstacles*/) const noexcept {
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const PositionLimit& limit = limits_[i];
    const double v = state.v()[limit.joint_coordinate];
    const double h = limit.sign * (state.q()[limit.joint_coordinate] - limit.position);
    if (!(h < activations()[k])) {
      continue;
    }
    out.clearances.values[k] = h;
    out.clearances.rates[k] = limit.sign * v;
    out.clearances.curvatures[k] = 0.0;
    out.clearances.gradients.col(k).setZero();
    out.clearances.gradients(limit.joint_coordinate, k) = limit.sign;
  }
  add_barriers(out);
}

CoordinateLabel JointLimitBarrier::label(int k) const {
  const PositionLimit& limit = limits_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::joint_limit, robot().coordinate_names()[static_cast<std::size_t>(limit.joint_coordinate)],
          limit.sign > 0.0 ? "lower" : "upper", floor(k), robot().is_prismatic(limit.joint_coordinate)};
}

}  // namespace sidestep
