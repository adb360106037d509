#pragma once

#include "sidestep/constraints/motion_solution.hpp"
#include "sidestep/constraints/program_rows.hpp"

namespace sidestep {

/// What the acceleration should be: minimise 1/2 (q̈ − a)'Q(q̈ − a) + 1/2 t'Rt with t = torque / effort limit.
struct TrackingCost {
  const Eigen::MatrixXd& mass;
  const Eigen::VectorXd& bias;
  const Eigen::VectorXd& wanted;           ///< Wanted acceleration a (nv) [/s²].
  const Eigen::VectorXd& tracking_weight;  ///< Tracking weight Q (nv).
  const Eigen::VectorXd& torque_cost;      ///< Torque cost R / effort limit² (nv).
};

/// The program in which nothing gives way: over q̈, in a box, with the torques' rows and then all blocks.
class HardProgram {
 public:
  HardProgram(int num_coordinates, const std::vector<RowBlock>& blocks);

  void write_cost(const TrackingCost& cost) noexcept;
  void write_torque(const Eigen::MatrixXd& mass, const TorqueWindow& window) noexcept;
  /// Writes acceleration and active limits, and the multipliers of the blocks; false if there is no such acceleration.
  bool solve(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, bool smooth, const Bounds& bounds,
             std::vector<RowBlock>& blocks, MotionSolution& solution) noexcept;
  const QuadraticProgramData& data() const noexcept { return data_; }

 private:
  SpanCounter counter_;
  Span torque_;
  std::vector<Span> rows_;  // Rows of each block.
  QuadraticProgramData data_;
  QuadraticProgram program_;
  Eigen::VectorXd weighted_;  // Column of the mass matrix, weighted by the cost of torques.
};

}  // namespace sidestep
