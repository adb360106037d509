#include "sidestep/constraints/program_rows.hpp"

#include "../math/settings.hpp"
#include "sidestep/constraints/motion_solution.hpp"

namespace sidestep {

std::vector<Span> spans_of(const std::vector<RowBlock>& blocks, Priority priority, SpanCounter& counter) {
  std::vector<Span> spans;
  for (const RowBlock& block : blocks) {
    spans.push_back(counter.take(block.priority == priority ? block.capacity() : 0));
  }
  return spans;
}

int capacity_of(const std::vector<RowBlock>& blocks, Priority priority) noexcept {
  int sum = 0;
  for (const RowBlock& block : blocks) {
    sum += block.priority == priority ? block.capacity() : 0;
  }
  return sum;
}

void write_rows(const RowBlock& block, Span at, const Eigen::VectorXd& box_lower, const Eigen::VectorXd& box_upper, int slack,
                QuadraticProgramData& data) noexcept {
  data.row_lower.segment(at.begin, at.size).setConstant(-infinity);
  data.row_upper.segment(at.begin, at.size).setConstant(infinity);
  if (at.size == 0) {
    return;
  }
  for (int k = 0; k < block.size; ++k) {
    if (block.satisfied_within(k, box_lower, box_upper)) {
      continue;
    }
    data.A.row(at[k]).head(block.normals.cols()) = block.normals.row(k);
    data.row_lower[at[k]] = block.lower[k];
    data.row_upper[at[k]] = block.upper[k];
    if (slack >= 0) {
      data.A(at[k], slack) = (block.is_at_most(k) ? -1.0 : 1.0) / block.lengths[k];
    }
  }
}

void write_torque(const Eigen::MatrixXd& mass, const TorqueWindow& window, Span at, QuadraticProgramData& data) noexcept {
  data.A.block(at.begin, 0, at.size, at.size) = mass;
  data.row_lower.segment(at.begin, at.size) = window.lower;
  data.row_upper.segment(at.begin, at.size) = window.upper;
}

void read_multipliers(const QuadraticProgram& program, Span at, RowBlock& block) noexcept {
  for (int k = 0; at.size > 0 && k < block.size; ++k) {
    block.multipliers[k] = block.pressure(k, program.multipliers()[program.num_variables() + at[k]]);
  }
}

void add_active(const Bounds& bounds, bool smooth, int i, const JointMultipliers& multipliers,
                MotionSolution& solution) noexcept {
  const auto joint = static_cast<std::size_t>(i);
  const auto& upper = smooth ? bounds.box.smooth_upper_limit : bounds.box.upper_limit;
  const auto& lower = smooth ? bounds.box.smooth_lower_limit : bounds.box.lower_limit;
  solution.active[joint] = solution.active[joint] |
                           (multipliers.at_upper > 0.0   ? upper[joint]
                            : multipliers.at_lower < 0.0 ? lower[joint]
                                                         : Limit::none) |
                           (multipliers.at_torque > 0.0   ? bounds.torque.upper_limit[joint]
                            : multipliers.at_torque < 0.0 ? bounds.torque.lower_limit[joint]
                                                          : Limit::none);
}

}  // namespace sidestep
