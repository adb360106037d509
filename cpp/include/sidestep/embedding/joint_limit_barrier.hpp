#pragma once

#include <vector>

#include "sidestep/embedding/barrier_function.hpp"
#include "sidestep/embedding/embedding.hpp"

namespace sidestep {

/// One coordinate per finite position limit, a barrier of the way left to it,
///
///     ψ = strength (activation / h − 1)^power,   h = q_j − q_j⁻ or q_j⁺ − q_j  [rad | m],
///
/// of the same kind as the clearance barriers. The acceleration bounds of the controller hold the limits; this one
/// makes the motion bend before it comes to that.
class JointLimitBarrier final : public Embedding {
 public:
  /// Throws std::invalid_argument that names the setting, or if the robot has no finite position limit.
  JointLimitBarrier(const Robot& robot, BarrierFunction barrier);

  int num_coordinates() const noexcept override { return static_cast<int>(limits_.size()); }
  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;
  CoordinateLabel label(int k) const override;

 private:
  struct PositionLimit {
    int joint_coordinate;
    double sign;      // +1: lower limit, −1: upper limit
    double position;
  };
  BarrierFunction barrier_;
  std::vector<PositionLimit> limits_;
};

}  // namespace sidestep
