// The programs of TorqueController after the first: what gives way where not everything can be kept.
#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"
#include "sidestep/constraints/torque_controller.hpp"

namespace sidestep {
namespace {

// The program of least shortfalls prefers small accelerations with this weight, so that there is one solution.
constexpr double regularisation = 1e-6;
// That of the ways out of what is lost, which a joint of little leverage [rad/rad] is not to be flung about for.
constexpr double lost_regularisation = 1e-2;
// Shortfalls below this, relative to 1 /s^2 plus what is asked for, may be of the regularisation alone, and are not granted. Those of
// ways out are granted all the same: to avoid them, joints of no leverage would be flung about.
constexpr double shortfall_tolerance = 1e-4;
// ε: the shortfall of a clearance that the joints change by less than 5 cm/rad counts less [(m/rad)²].
constexpr double least_gradient_squared = 0.05 * 0.05;
// The least that a shortfall counts. A clearance of little leverage falls short by much: more would fling joints about.
constexpr double least_weight = 1e-9;

}  // namespace

void TorqueController::widen_bounds() noexcept {
  wide_lower_ = bounds_.lower;
  wide_upper_ = bounds_.upper;
  if (settings_.hard_bounds) {
    return;
  }
  // To the overruns, which nothing exceeds: neither what position limits ask for nor, where torques change at a limited rate,
  // what could not be taken back in time. Feedback has its own factor.
  for (int i = 0; i < nv_; ++i) {
    const double most = std::max(settings_.acceleration_overrun, acceleration_factor_) * limits_.acceleration[i];
    const double fastest = settings_.velocity_overrun * limits_.velocity[i];
    double upper = std::clamp((fastest - velocity_[i]) / settings_.period, -most, most);
    double lower = std::clamp((-fastest - velocity_[i]) / settings_.period, -most, most);
    const double jerk = jerk_share_ * limits_.jerk[i];
    if (limits_.effort_rate[i] < infinity && jerk < infinity) {
      const ScalarLimits limits{limits_.lower[i] + settings_.position_margin, limits_.upper[i] - settings_.position_margin,
                                fastest, limits_.acceleration[i]};
      const double up =
          largest_returnable(limits.upper - position_[i], velocity_[i], lower, upper, limits, jerk, settings_.period).value;
      const double down =
          -largest_returnable(position_[i] - limits.lower, -velocity_[i], -upper, -lower, limits, jerk, settings_.period).value;
      if (down <= up) {
        lower = std::clamp(down, lower, upper);
        upper = std::clamp(up, lower, upper);
      }
    }
    const double position_lower = std::min(bounds_.position_lower[i], upper);
    const double position_upper = std::max(bounds_.position_upper[i], lower);
    if (position_lower <= position_upper) {
      lower = std::max(lower, position_lower);
      upper = std::min(upper, position_upper);
    }
    wide_lower_[i] = std::clamp(jerk_lower_[i], lower, upper);
    wide_upper_[i] = std::clamp(jerk_upper_[i], lower, upper);
  }
}

bool TorqueController::presses_for_lost() const noexcept {
  for (int k = 0; k < rows_.size(); ++k) {
    if (rows_.depths[k] > 0.0 && row_multipliers_[k] > 0.0) {
      return true;
    }
  }
  return false;
}

bool TorqueController::others_fall_short(const TorqueSolution& solution) const noexcept {
  for (int k = 0; k < rows_.size(); ++k) {
    const double short_by = rows_.lower[k] - rows_.normals.row(k).dot(solution.acceleration.transpose());
    if (rows_.depths[k] == 0.0 && short_by > shortfall_tolerance * (1.0 + std::abs(rows_.lower[k]))) {
      return true;
    }
  }
  return false;
}

void TorqueController::collect_rows() noexcept {
  num_rows_used_ = 0;
  for (int k = 0; k < rows_.size(); ++k) {
    if (!rows_.satisfied_within(k, wide_lower_, wide_upper_)) {
      rows_used_[static_cast<std::size_t>(num_rows_used_++)] = k;
    }
  }
}

double TorqueController::lowered(int n, bool rounded) const noexcept {
  const int row = rows_used_[static_cast<std::size_t>(n)];
  const double asked = rows_.lower[row], size = 1.0 + std::abs(asked);
  const double counts = rows_.depths[row] > 0.0 ? 0.0 : shortfall_tolerance * size;
  return rounded ? asked - allowed_[n] - slack_tolerance * size : allowed_[n] > counts ? asked - allowed_[n] : asked;
}

bool TorqueController::solve_least(LeastShortfall& least, bool of_lost, TorqueSolution& solution) noexcept {
  QuadraticProgramData& data = least.data;
  data.lower.head(nv_) = wide_lower_;
  data.upper.head(nv_) = wide_upper_;
  data.H.diagonal().head(nv_).setConstant(of_lost ? lost_regularisation : regularisation);
  for (int i = 0; i < nv_; ++i) {
    data.g[i] = of_lost ? -lost_regularisation * std::clamp(wanted_[i], bounds_.lower[i], bounds_.upper[i]) : 0.0;
  }
  for (int n = 0; n < num_rows_used_; ++n) {
    const int row = rows_used_[static_cast<std::size_t>(n)];
    const bool lost = rows_.depths[row] > 0.0, shared = lost == of_lost;
    data.A(nv_ + n, nv_ + n) = shared ? 1.0 : 0.0;
    data.row_lower[nv_ + n] = shared ? rows_.lower[row] : of_lost ? lowered(n, true) : -infinity;
  }
  if (least.program.solve(data) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = least.program.solution().head(nv_);
  for (int n = 0; n < num_rows_used_; ++n) {
    const int row = rows_used_[static_cast<std::size_t>(n)];
    if (of_lost || rows_.depths[row] == 0.0) {
      const double short_by = rows_.lower[row] - rows_.normals.row(row).dot(solution.acceleration.transpose());
      row_multipliers_[row] = allowed_[n] = std::max(short_by, 0.0);
    }
  }
  for (int i = 0; i < nv_; ++i) {  // what the shortfalls are due to
    const Eigen::VectorXd& multipliers = least.program.multipliers();
    add_active(i, multipliers[i], multipliers[i], multipliers[nv_ + least.num_rows + i], false, solution);
  }
  return true;
}

bool TorqueController::find_least_shortfalls(TorqueSolution& solution) noexcept {
  LeastShortfall& least =
      *std::find_if(least_.begin(), least_.end() - 1, [this](const LeastShortfall& l) { return l.num_rows >= num_rows_used_; });
  QuadraticProgramData& data = least.data;
  data.A.topLeftCorner(nv_, nv_) = mass_;
  data.A.bottomRows(least.num_rows).setZero();
  data.row_lower.head(nv_) = hard_data_.row_lower.head(nv_);
  data.row_upper.head(nv_) = hard_data_.row_upper.head(nv_);
  data.row_lower.tail(least.num_rows).setConstant(-infinity);
  double deepest = 0.0;
  for (int n = 0; n < num_rows_used_; ++n) {
    deepest = std::max(deepest, rows_.depths[rows_used_[static_cast<std::size_t>(n)]]);
  }
  for (int n = 0; n < num_rows_used_; ++n) {
    const int row = rows_used_[static_cast<std::size_t>(n)];
    const double squared = rows_.lengths[row] * rows_.lengths[row];
    data.A.row(nv_ + n).head(nv_) = rows_.normals.row(row);
    const double share = rows_.depths[row] > 0.0 ? rows_.depths[row] / deepest : 1.0;
    data.H(nv_ + n, nv_ + n) = std::max(squared / (squared + least_gradient_squared) * share, least_weight);
  }
  allowed_.setZero();
  if (!solve_least(least, false, solution)) {
    // The torque does not reach the box: widen it by as little as that takes, and say so.
    box_reached_ = false;
    widening_data_.H.diagonal().head(nv_).setConstant(regularisation);
    widening_data_.A.bottomLeftCorner(nv_, nv_) = mass_;
    widening_data_.row_lower << wide_lower_, hard_data_.row_lower.head(nv_);
    widening_data_.row_upper << wide_upper_, hard_data_.row_upper.head(nv_);
    if (widening_.solve(widening_data_) != QuadraticProgramStatus::solved) {
      return false;
    }
    for (int i = 0; i < nv_; ++i) {
      const double reached = widening_.solution()[i], rounding = slack_tolerance * (1.0 + std::abs(reached));
      wide_lower_[i] = std::min(wide_lower_[i], reached - rounding);
      wide_upper_[i] = std::max(wide_upper_[i], reached + rounding);
    }
    solution.acceleration = widening_.solution().head(nv_);
    static_cast<void>(solve_least(least, false, solution));
  }
  if (deepest > 0.0 && !solve_least(least, true, solution)) {
    for (int n = 0; n < num_rows_used_; ++n) {  // as the first solution leaves them
      const int row = rows_used_[static_cast<std::size_t>(n)];
      allowed_[n] = std::max(rows_.lower[row] - rows_.normals.row(row).dot(solution.acceleration.transpose()), 0.0);
    }
  }
  return true;
}

bool TorqueController::solve_comfort(bool rounded, TorqueSolution& solution) noexcept {
  QuadraticProgramData& data = comfort_data_;
  double steepest = 0.0;
  for (int i = 0; i < nv_; ++i) {
    const double beyond = std::abs(wanted_[i] - std::clamp(wanted_[i], bounds_.lower[i], bounds_.upper[i]));
    steepest = std::max(steepest, tracking_weight_[i] * (1.0 + beyond));
  }
  data.H.topLeftCorner(nv_, nv_) = hard_data_.H;
  data.H.diagonal().segment(nv_, nv_) = tracking_weight_;
  data.g.head(nv_) = hard_data_.g;
  data.g.tail(num_slacks_).setConstant(settings_.slack_weight * steepest);
  data.lower.head(nv_) = wide_lower_;
  data.upper.head(nv_) = wide_upper_;
  data.row_upper.head(nv_) = bounds_.upper;
  data.row_lower.segment(nv_, nv_) = bounds_.lower;
  data.A.block(2 * nv_, 0, nv_, nv_) = mass_;
  data.row_lower.segment(2 * nv_, nv_) = hard_data_.row_lower.head(nv_);
  data.row_upper.segment(2 * nv_, nv_) = hard_data_.row_upper.head(nv_);
  data.row_lower.segment(3 * nv_, rows_.max_size()).setConstant(-infinity);
  for (int n = 0; n < num_rows_used_; ++n) {
    const int row = rows_used_[static_cast<std::size_t>(n)], at = 3 * nv_ + n;
    data.A.row(at).head(nv_) = rows_.normals.row(row);
    data.row_lower[at] = lowered(n, rounded);
  }
  write_speed_rows(data, 3 * nv_ + rows_.max_size(), 2 * nv_, wide_lower_, wide_upper_);
  if (comfort_.solve(data) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = comfort_.solution().head(nv_);
  const Eigen::VectorXd& multipliers = comfort_.multipliers();
  const int first_row = nv_ + num_slacks_;  // multipliers of the bounds come before those of the rows
  for (int i = 0; i < nv_; ++i) {
    add_active(i, std::max(multipliers[i], multipliers[first_row + i]),
               std::min(multipliers[i], multipliers[first_row + nv_ + i]), multipliers[first_row + 2 * nv_ + i], false,
               solution);
  }
  for (int n = 0; n < num_rows_used_; ++n) {
    row_multipliers_[rows_used_[static_cast<std::size_t>(n)]] = std::max(-multipliers[first_row + 3 * nv_ + n], 0.0);
  }
  for (int k = 0; k < num_speed_rows(); ++k) {
    speed_multipliers_[k] = std::max(multipliers[first_row + 3 * nv_ + rows_.max_size() + k], 0.0);
  }
  return accept(solution);
}

TorqueStatus TorqueController::solve_relaxed(bool smooth, TorqueSolution& solution) noexcept {
  if (smooth) {
    wide_lower_ = bounds_.smooth_lower;
    wide_upper_ = bounds_.smooth_upper;
  } else {
    widen_bounds();
  }
  box_reached_ = true;
  collect_rows();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  allowed_.setZero();
  row_multipliers_.setZero();
  speed_multipliers_.setZero();
  const bool found = (solve_comfort(false, solution) && !presses_for_lost()) ||
                     (find_least_shortfalls(solution) && (solve_comfort(false, solution) || solve_comfort(true, solution) ||
                                                          (find_least_shortfalls(solution) && accept(solution))));
  if (!found) {
    stop(true, solution);
    return TorqueStatus::fallback_solver;
  }
  double farthest = 0.0;
  for (int i = 0; i < nv_; ++i) {
    farthest = std::max(farthest, std::abs(wanted_[i] - std::clamp(wanted_[i], bounds_.lower[i], bounds_.upper[i])));
  }
  const auto outside = [farthest](double amount, double bound) {
    return std::abs(amount) > slack_tolerance * (1.0 + std::abs(bound) + farthest) ? amount : 0.0;
  };
  bool bounds_kept = true, safe = box_reached_;
  for (int i = 0; i < nv_; ++i) {
    double& q_ddot = solution.acceleration[i];
    const double beyond = q_ddot - std::clamp(q_ddot, bounds_.lower[i], bounds_.upper[i]);
    solution.slack[i] = outside(beyond, beyond > 0.0 ? bounds_.upper[i] : bounds_.lower[i]);
    bounds_kept = bounds_kept && solution.slack[i] == 0.0;
    const double beyond_position = q_ddot - std::clamp(q_ddot, bounds_.position_lower[i], bounds_.position_upper[i]);
    safe = safe && outside(beyond_position, q_ddot - beyond_position) == 0.0;
    if (settings_.hard_bounds && solution.slack[i] == 0.0) {
      q_ddot -= beyond;  // rounding
    }
  }
  for (int n = 0; n < num_rows_used_; ++n) {
    const int row = rows_used_[static_cast<std::size_t>(n)];
    const double short_by = rows_.lower[row] - rows_.normals.row(row).dot(solution.acceleration.transpose());
    safe = safe && !(outside(short_by, rows_.lower[row]) > 0.0);
  }
  return !safe ? TorqueStatus::relaxed_safety : !bounds_kept ? TorqueStatus::relaxed : TorqueStatus::limited;
}

}  // namespace sidestep
