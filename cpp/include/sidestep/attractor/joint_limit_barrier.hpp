#pragma once

#include <vector>

#include "sidestep/attractor/barrier.hpp"

namespace sidestep {

/// One coordinate per finite position limit, a barrier of the way left to it,
///
///     ψ = strength (activation / h − 1)^power,   h = q_j − q_j⁻ or q_j⁺ − q_j  [rad | m],
///
/// of the same kind as the clearance barriers. The activation distance of a prismatic joint is no longer than
/// `range_share` of its range: a finger with 40 mm of travel is free to use nearly all of it. The acceleration bounds
/// of the controller hold the limits; this one makes the motion bend before it comes to that.
class JointLimitBarrier final : public Barrier {
 public:
  static constexpr double range_share = 0.05;  // Longest activation distance of a prismatic joint, as a share of its range [-].

  /// Throws std::invalid_argument that names the setting, or if the robot has no finite position limit.
  JointLimitBarrier(const Robot& robot, BarrierFunction barrier);

  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;
  CoordinateLabel label(int k) const override;

 private:
  struct PositionLimit {
    int joint_coordinate;
    double sign;  // +1: lower limit, −1: upper limit.
    double position;
  };
  std::vector<PositionLimit> limits_;
};

}  // namespace sidestep
