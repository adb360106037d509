#include "sidestep/constraints/shortfall_program.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"
#include "tolerances.hpp"

namespace sidestep {
namespace {

// Rows of the smallest program of least shortfalls; the next ones double.
constexpr int fewest_rows = 4;
// Weight of small accelerations in the program of least shortfalls, so that there is one solution.
constexpr double regularisation = 1e-6;
// The same for recovery, so that a joint of little leverage [rad/rad] is not flung about.
constexpr double lost_regularisation = 1e-2;
// Square ε of the gradient below which the shortfall of a clearance counts less [(m/rad)²]: joints change it by less than
// 5 cm/rad.
constexpr double least_gradient_squared = 0.05 * 0.05;
// Smallest weight of a shortfall. A clearance of little leverage falls short by much: more would fling joints about.
constexpr double least_weight = 1e-9;

double deepest_of(const ShortRows& short_rows) noexcept {
  double deepest = 0.0;
  for (int n = 0; n < short_rows.size(); ++n) {
    deepest = std::max(deepest, short_rows[n].block->depths[short_rows[n].k]);
  }
  return deepest;
}

}  // namespace

ShortfallProgram::Program::Program(int num_coordinates, int capacity, const std::vector<RowBlock>& blocks)
    : torque(counter.take(num_coordinates)),
      short_rows(counter.take(capacity)),
      never(spans_of(blocks, Priority::never, counter)),
      data(num_coordinates + capacity, counter.count()),
      program(num_coordinates + capacity, counter.count()) {}

ShortfallProgram::ShortfallProgram(int num_coordinates, const std::vector<RowBlock>& blocks)
    : nv_(num_coordinates),
      box_(counter_.take(num_coordinates)),
      torque_(counter_.take(num_coordinates)),
      never_(spans_of(blocks, Priority::never, counter_)),
      widening_data_(2 * num_coordinates, counter_.count()),
      widening_(2 * num_coordinates, counter_.count()),
      everywhere_(num_coordinates) {
  everywhere_.lower.setConstant(-infinity);
  everywhere_.upper.setConstant(infinity);
  // q̈ + e within the box, the torque rows.
  widening_data_.A.topLeftCorner(nv_, nv_).setIdentity();
  widening_data_.A.topRightCorner(nv_, nv_).setIdentity();
  const int most = capacity_of(blocks, Priority::clearance);
  for (int num = fewest_rows; num < most; num *= 2) {
    programs_.emplace_back(nv_, num, blocks);
  }
  programs_.emplace_back(nv_, most, blocks);
}

ShortfallProgram::Found ShortfallProgram::solve(const TrackingCost& cost, Bounds& bounds, std::vector<RowBlock>& blocks,
                                                ShortRows& short_rows, MotionSolution& solution) noexcept {
  Program& program = *std::find_if(programs_.begin(), programs_.end() - 1,
                                   [&](const Program& one) { return one.short_rows.size >= short_rows.size(); });
  const double deepest = deepest_of(short_rows);
  write(program, cost, bounds, blocks, short_rows, deepest);
  short_rows.forbid_all();
  Found found;
  if (!solve(program, false, cost, bounds, short_rows, solution)) {
    // The torque does not reach the box: widen it by as little as that takes, and say so.
    if (!widen(cost, blocks, bounds, solution)) {
      return {false, false};
    }
    found.within_box = false;
    write(program, cost, bounds, blocks, short_rows, deepest);
    static_cast<void>(solve(program, false, cost, bounds, short_rows, solution));
  }
  if (deepest > 0.0 && !solve(program, true, cost, bounds, short_rows, solution)) {
    for (int n = 0; n < short_rows.size(); ++n) {  // as the first solution leaves them
      ShortRows::Row& row = short_rows[n];
      row.allowed = std::max(row.block->missing(row.k, solution.acceleration), 0.0);
    }
  }
  return found;
}

void ShortfallProgram::write(Program& program, const TrackingCost& cost, const Bounds& bounds,
                             const std::vector<RowBlock>& blocks, const ShortRows& short_rows, double deepest) noexcept {
  QuadraticProgramData& data = program.data;
  const Span at = program.short_rows;
  data.A.middleRows(at.begin, at.size).setZero();
  data.row_lower.segment(at.begin, at.size).setConstant(-infinity);
  data.row_upper.segment(at.begin, at.size).setConstant(infinity);
  write_torque(cost.mass, bounds.torque, program.torque, data);
  for (int n = 0; n < short_rows.size(); ++n) {
    const auto& [block, k, allowed] = short_rows[n];
    const double squared = block->lengths[k] * block->lengths[k];
    data.A.row(at[n]).head(nv_) = block->normals.row(k);
    const double share = block->depths[k] > 0.0 ? block->depths[k] / deepest : 1.0;
    data.H(nv_ + n, nv_ + n) = std::max(squared / (squared + least_gradient_squared) * share, least_weight);
  }
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    write_rows(blocks[b], program.never[b], bounds.wide.lower, bounds.wide.upper, -1, data);
  }
}

bool ShortfallProgram::solve(Program& program, bool of_lost, const TrackingCost& cost, const Bounds& bounds,
                             ShortRows& short_rows, MotionSolution& solution) noexcept {
  QuadraticProgramData& data = program.data;
  data.lower.head(nv_) = bounds.wide.lower;
  data.upper.head(nv_) = bounds.wide.upper;
  data.H.diagonal().head(nv_).setConstant(of_lost ? lost_regularisation : regularisation);
  for (int i = 0; i < nv_; ++i) {
    data.g[i] = of_lost ? -lost_regularisation * std::clamp(cost.wanted[i], bounds.box.lower[i], bounds.box.upper[i]) : 0.0;
  }
  for (int n = 0; n < short_rows.size(); ++n) {
    const ShortRows::Row& row = short_rows[n];
    const bool shared = row.lost() == of_lost;
    const int at = program.short_rows[n];
    data.A(at, nv_ + n) = !shared ? 0.0 : row.block->is_at_most(row.k) ? -1.0 : 1.0;
    write_required(*row.block, row.k, at, shared ? row.block->required(row.k) : of_lost ? row.lowered(true) : -infinity, data);
  }
  if (program.program.solve(data) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = program.program.solution().head(nv_);
  for (int n = 0; n < short_rows.size(); ++n) {
    ShortRows::Row& row = short_rows[n];
    if (of_lost || !row.lost()) {
      row.block->multipliers[row.k] = row.allowed = std::max(row.block->missing(row.k, solution.acceleration), 0.0);
    }
  }
  const Eigen::VectorXd& multipliers = program.program.multipliers();
  for (int i = 0; i < nv_; ++i) {  // what the shortfalls are due to
    add_active(bounds, false, i,
               {multipliers[i], multipliers[i], multipliers[program.program.num_variables() + program.torque[i]]}, solution);
  }
  return true;
}

bool ShortfallProgram::widen(const TrackingCost& cost, const std::vector<RowBlock>& blocks, Bounds& bounds,
                             MotionSolution& solution) noexcept {
  QuadraticProgramData& data = widening_data_;
  data.H.diagonal().head(nv_).setConstant(regularisation);
  data.row_lower.segment(box_.begin, nv_) = bounds.wide.lower;
  data.row_upper.segment(box_.begin, nv_) = bounds.wide.upper;
  write_torque(cost.mass, bounds.torque, torque_, data);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    write_rows(blocks[b], never_[b], everywhere_.lower, everywhere_.upper, -1, data);
  }
  if (widening_.solve(data) != QuadraticProgramStatus::solved) {
    return false;
  }
  for (int i = 0; i < nv_; ++i) {
    const double reached = widening_.solution()[i], rounding = slack_tolerance * (1.0 + std::abs(reached));
    bounds.wide.lower[i] = std::min(bounds.wide.lower[i], reached - rounding);
    bounds.wide.upper[i] = std::max(bounds.wide.upper[i], reached + rounding);
  }
  solution.acceleration = widening_.solution().head(nv_);
  return true;
}

}  // namespace sidestep
