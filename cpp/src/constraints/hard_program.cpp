#include "sidestep/constraints/hard_program.hpp"

#include <algorithm>

#include "sidestep/math/vectors.hpp"

namespace sidestep {
namespace {

std::vector<Span> all_spans(const std::vector<RowBlock>& blocks, SpanCounter& counter) {
  std::vector<Span> spans;
  for (const RowBlock& block : blocks) {
    spans.push_back(counter.take(block.capacity()));
  }
  return spans;
}

}  // namespace

HardProgram::HardProgram(int num_coordinates, const std::vector<RowBlock>& blocks)
    : torque_(counter_.take(num_coordinates)),
      rows_(all_spans(blocks, counter_)),
      data_(num_coordinates, counter_.count()),
      program_(num_coordinates, counter_.count()),
      weighted_(Eigen::VectorXd::Zero(num_coordinates)) {}

void HardProgram::write_cost(const TrackingCost& cost) noexcept {
  // H = Q + M R' M,  g = -Q a + M R' h   with R' = R / effort limit^2.
  with_size(weighted_.size(), [&](auto nv) {
    auto weighted = sized(weighted_, nv);
    const auto bias = sized(cost.bias, nv);
    for (Eigen::Index i = 0; i < nv; ++i) {
      weighted = sized(cost.mass.col(i), nv).cwiseProduct(sized(cost.torque_cost, nv));
      for (Eigen::Index j = 0; j <= i; ++j) {
        const auto column = sized(cost.mass.col(j), nv);
        double value = i == j ? cost.tracking_weight[i] : 0.0;
        for (Eigen::Index k = 0; k < nv; ++k) {
          value += weighted[k] * column[k];
        }
        data_.H(i, j) = data_.H(j, i) = value;
      }
      double value = -cost.tracking_weight[i] * cost.wanted[i];
      for (Eigen::Index k = 0; k < nv; ++k) {
        value += weighted[k] * bias[k];
      }
      data_.g[i] = value;
    }
  });
}

void HardProgram::write_torque(const Eigen::MatrixXd& mass, const TorqueWindow& window) noexcept {
  sidestep::write_torque(mass, window, torque_, data_);
}

bool HardProgram::solve(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, bool smooth, const Bounds& bounds,
                        std::vector<RowBlock>& blocks, MotionSolution& solution) noexcept {
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  data_.lower = lower;
  data_.upper = upper;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    blocks[b].multipliers.setZero();
    write_rows(blocks[b], rows_[b], lower, upper, -1, data_);
  }
  if (program_.solve(data_) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = program_.solution().cwiseMax(lower).cwiseMin(upper);  // rounding
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    read_multipliers(program_, rows_[b], blocks[b]);
  }
  const Eigen::VectorXd& multipliers = program_.multipliers();
  for (int i = 0; i < torque_.size; ++i) {
    add_active(bounds, smooth, i, {multipliers[i], multipliers[i], multipliers[program_.num_variables() + torque_[i]]},
               solution);
  }
  return true;
}

}  // namespace sidestep
