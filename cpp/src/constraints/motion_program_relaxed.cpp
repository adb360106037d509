// The programs of MotionProgram after the first: what gives way where not everything can be kept.
#include <algorithm>
#include <cmath>

#include "sidestep/constraints/motion_program.hpp"
#include "tolerances.hpp"

namespace sidestep {

bool MotionProgram::solve_slack(bool rounded, MotionSolution& solution) noexcept {
  return slack_.solve(hard_.data(), cost(), bounds_, short_rows_, rounded, blocks_, solution) && accept(solution);
}

ProgramStatus MotionProgram::solve_relaxed(const Moment& now, bool smooth, MotionSolution& solution) noexcept {
  if (smooth) {
    bounds_.wide.lower = bounds_.box.smooth_lower;
    bounds_.wide.upper = bounds_.box.smooth_upper;
  } else {
    for (const auto& constraint : constraints_) {
      constraint->widen(Priority::comfort, now, bounds_);
    }
  }
  short_rows_.collect(blocks_, bounds_.wide.lower, bounds_.wide.upper);
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  for (RowBlock& block : blocks_) {
    block.multipliers.setZero();
  }
  bool box_reached = true;
  const auto find_shortfalls = [&] {
    const auto found = shortfall_.solve(cost(), bounds_, blocks_, short_rows_, solution);
    box_reached = box_reached && found.within_box;
    return found.any;
  };
  const bool found = (solve_slack(false, solution) && !presses_for_lost(blocks_)) ||
                     (find_shortfalls() &&
                      (solve_slack(false, solution) || solve_slack(true, solution) || (find_shortfalls() && accept(solution))));
  if (!found) {
    stop(now, true, solution);
    return ProgramStatus::fallback_solver;
  }
  return judge_relaxed(box_reached, solution);
}

ProgramStatus MotionProgram::judge_relaxed(bool box_reached, MotionSolution& solution) const noexcept {
  const AccelerationBounds& box = bounds_.box;
  double farthest = 0.0;
  for (int i = 0; i < nv_; ++i) {
    farthest = std::max(farthest, std::abs(wanted_[i] - std::clamp(wanted_[i], box.lower[i], box.upper[i])));
  }
  const auto outside = [farthest](double amount, double bound) {
    return std::abs(amount) > slack_tolerance * (1.0 + std::abs(bound) + farthest) ? amount : 0.0;
  };
  bool bounds_kept = true, safe = box_reached;
  for (int i = 0; i < nv_; ++i) {
    double& q_ddot = solution.acceleration[i];
    const double beyond = q_ddot - std::clamp(q_ddot, box.lower[i], box.upper[i]);
    solution.slack[i] = outside(beyond, beyond > 0.0 ? box.upper[i] : box.lower[i]);
    bounds_kept = bounds_kept && solution.slack[i] == 0.0;
    const double beyond_position = q_ddot - std::clamp(q_ddot, box.position_lower[i], box.position_upper[i]);
    safe = safe && outside(beyond_position, q_ddot - beyond_position) == 0.0;
    if (settings_.hard_bounds && solution.slack[i] == 0.0) {
      q_ddot -= beyond;  // rounding
    }
  }
  for (int n = 0; n < short_rows_.size(); ++n) {
    const ShortRows::Row& row = short_rows_[n];
    const double short_by = row.block->missing(row.k, solution.acceleration);
    safe = safe && !(outside(short_by, row.block->required(row.k)) > 0.0);
  }
  return !safe ? ProgramStatus::relaxed_safety : !bounds_kept ? ProgramStatus::relaxed : ProgramStatus::limited;
}

}  // namespace sidestep
