#include "sidestep/constraints/slack_program.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {

SlackProgram::SlackProgram(int num_coordinates, const std::vector<RowBlock>& blocks, double slack_weight)
    : slack_weight_(slack_weight),
      acceleration_(variables_.take(num_coordinates)),
      slacks_(variables_.take(num_coordinates)),
      shared_slack_(variables_.take(capacity_of(blocks, Priority::comfort) > 0 ? 1 : 0)),
      upper_(counter_.take(num_coordinates)),
      lower_(counter_.take(num_coordinates)),
      torque_(counter_.take(num_coordinates)),
      short_(counter_.take(capacity_of(blocks, Priority::clearance))),
      comfort_(spans_of(blocks, Priority::comfort, counter_)),
      never_(spans_of(blocks, Priority::never, counter_)),
      data_(variables_.count(), counter_.count()),
      program_(variables_.count(), counter_.count()) {
  // q̈ - s <= upper, q̈ + s >= lower; s >= 0.
  const int nv = num_coordinates;
  data_.A.block(upper_.begin, 0, nv, nv).setIdentity();
  data_.A.block(upper_.begin, slacks_.begin, nv, nv).diagonal().setConstant(-1.0);
  data_.A.block(lower_.begin, 0, nv, nv).setIdentity();
  data_.A.block(lower_.begin, slacks_.begin, nv, nv).setIdentity();
  data_.lower.tail(slacks_.size + shared_slack_.size).setZero();
}

void SlackProgram::write(const QuadraticProgramData& hard, const TrackingCost& cost, const Bounds& bounds) noexcept {
  const int nv = acceleration_.size;
  double steepest = 0.0;
  for (int i = 0; i < nv; ++i) {
    const double beyond = std::abs(cost.wanted[i] - std::clamp(cost.wanted[i], bounds.box.lower[i], bounds.box.upper[i]));
    steepest = std::max(steepest, cost.tracking_weight[i] * (1.0 + beyond));
  }
  data_.H.topLeftCorner(nv, nv) = hard.H;
  data_.H.diagonal().segment(slacks_.begin, nv) = cost.tracking_weight;
  data_.g.head(nv) = hard.g;
  data_.g.tail(slacks_.size + shared_slack_.size).setConstant(slack_weight_ * steepest);
  data_.lower.head(nv) = bounds.wide.lower;
  data_.upper.head(nv) = bounds.wide.upper;
  data_.row_upper.segment(upper_.begin, nv) = bounds.box.upper;
  data_.row_lower.segment(lower_.begin, nv) = bounds.box.lower;
  write_torque(cost.mass, bounds.torque, torque_, data_);
}

bool SlackProgram::solve(const QuadraticProgramData& hard, const TrackingCost& cost, const Bounds& bounds,
                         const ShortRows& short_rows, bool rounded, std::vector<RowBlock>& blocks,
                         MotionSolution& solution) noexcept {
  write(hard, cost, bounds);
  data_.row_lower.segment(short_.begin, short_.size).setConstant(-infinity);
  data_.row_upper.segment(short_.begin, short_.size).setConstant(infinity);
  for (int n = 0; n < short_rows.size(); ++n) {
    const ShortRows::Row& row = short_rows[n];
    data_.A.row(short_[n]).head(acceleration_.size) = row.block->normals.row(row.k);
    write_required(*row.block, row.k, short_[n], row.lowered(rounded), data_);
  }
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    write_rows(blocks[b], comfort_[b], bounds.wide.lower, bounds.wide.upper, shared_slack_.begin, data_);
    write_rows(blocks[b], never_[b], bounds.wide.lower, bounds.wide.upper, -1, data_);
  }
  if (program_.solve(data_) != QuadraticProgramStatus::solved) {
    return false;
  }
  read(bounds, short_rows, blocks, solution);
  return true;
}

void SlackProgram::read(const Bounds& bounds, const ShortRows& short_rows, std::vector<RowBlock>& blocks,
                        MotionSolution& solution) noexcept {
  solution.acceleration = program_.solution().head(acceleration_.size);
  const Eigen::VectorXd& multipliers = program_.multipliers();
  const int first = program_.num_variables();  // multipliers of the bounds come before those of the rows
  for (int i = 0; i < acceleration_.size; ++i) {
    add_active(bounds, false, i,
               {std::max(multipliers[i], multipliers[first + upper_[i]]),
                std::min(multipliers[i], multipliers[first + lower_[i]]), multipliers[first + torque_[i]]},
               solution);
  }
  for (int n = 0; n < short_rows.size(); ++n) {
    const ShortRows::Row& row = short_rows[n];
    row.block->multipliers[row.k] = row.block->pressure(row.k, multipliers[first + short_[n]]);
  }
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    read_multipliers(program_, comfort_[b], blocks[b]);
    read_multipliers(program_, never_[b], blocks[b]);
  }
}

}  // namespace sidestep
