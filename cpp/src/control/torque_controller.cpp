#include "sidestep/control/torque_controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "../settings.hpp"
#include "cholesky.hpp"

namespace sidestep {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// A mass matrix that differs from its transpose by more than this fraction of its largest entry is not rounding but
// an error, for example a triangle that was never filled.
constexpr double symmetry_tolerance = 1e-6;
// The torque of a solved program is outside the effort limits by rounding at most; more than this fraction of the
// limit means that the solution is not one.
constexpr double torque_tolerance = 1e-6;
// Slack below this, relative to 1 /s^2 plus the bound, is rounding of the second program and not worth a status.
constexpr double slack_tolerance = 1e-9;
// The program of least shortfalls prefers small accelerations with this weight, so that there is one solution.
constexpr double regularisation = 1e-6;
// That of the ways out of what is lost, which a joint of little leverage [rad/rad] is not to be flung about for.
constexpr double lost_regularisation = 1e-2;
// Shortfalls below this, relative to 1 /s^2 plus what is asked for, may be of the regularisation alone.
constexpr double shortfall_tolerance = 1e-4;
// ε: the shortfall of a clearance that the joints change by less than 5 cm/rad counts less [(m/rad)²], as in recovery.hpp.
constexpr double least_gradient_squared = 0.05 * 0.05;
// The smallest program of least shortfalls; the next ones double.
constexpr int fewest_rows = 4;
// Damping [Nm s/rad | N s/m] of the stop for joints without an effort or a velocity limit to derive it from.
constexpr double unlimited_stop_damping = 1.0;

Eigen::VectorXd expanded(const Eigen::VectorXd& weight, int num) {
  return weight.size() == 1 ? Eigen::VectorXd::Constant(num, weight[0]) : weight;
}

void check_weight(const Eigen::VectorXd& weight, const char* setting, int num, bool zero_allowed) {
  const std::string owner = std::string("torque controller: ") + setting;
  if (weight.size() != 1 && weight.size() != num) {
    throw std::invalid_argument(owner + " has " + std::to_string(weight.size()) + " entries, allowed are 1 or " +
                                std::to_string(num));
  }
  for (const double w : weight) {
    if (!(w > 0.0 || (zero_allowed && w == 0.0)) || w == infinity) {
      throw std::invalid_argument(owner + " is " + std::to_string(w) + ", must be finite and " +
                                  (zero_allowed ? ">= 0" : "positive"));
    }
  }
}

}  // namespace

const char* name(TorqueStatus status) noexcept {
  switch (status) {
    case TorqueStatus::ok: return "ok";
    case TorqueStatus::limited: return "limited";
    case TorqueStatus::relaxed: return "relaxed";
    case TorqueStatus::relaxed_safety: return "relaxed_safety";
    case TorqueStatus::clearance_lost: return "clearance_lost";
    case TorqueStatus::fallback_invalid_input: return "fallback_invalid_input";
    case TorqueStatus::fallback_solver: return "fallback_solver";
  }
  return "unknown";
}

const char* name(TorqueFault fault) noexcept {
  switch (fault) {
    case TorqueFault::none: return "none";
    case TorqueFault::position: return "position";
    case TorqueFault::velocity: return "velocity";
    case TorqueFault::acceleration: return "acceleration";
    case TorqueFault::mass_matrix: return "mass_matrix";
    case TorqueFault::bias: return "bias";
    case TorqueFault::clearances: return "clearances";
  }
  return "unknown";
}

TorqueSolution::TorqueSolution(int num_coordinates, int max_safety_rows)
    : torque(Eigen::VectorXd::Zero(num_coordinates)),
      acceleration(Eigen::VectorXd::Zero(num_coordinates)),
      slack(Eigen::VectorXd::Zero(num_coordinates)),
      lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      active(static_cast<std::size_t>(num_coordinates), Limit::none),
      safety(static_cast<std::size_t>(max_safety_rows)) {}

void TorqueControllerSettings::validate(const Robot& robot) const {
  const int nv = robot.num_coordinates();
  require_positive(period, "torque controller: period");
  check_weight(tracking_weight, "tracking_weight", nv, false);
  check_weight(torque_weight, "torque_weight", nv, true);
  require_positive(slack_weight, "torque controller: slack_weight");
  require(velocity_overrun >= 1.0 && velocity_overrun < infinity, "torque controller: velocity_overrun",
          velocity_overrun, "finite and >= 1");
  require(acceleration_overrun >= 1.0 && acceleration_overrun < infinity, "torque controller: acceleration_overrun",
          acceleration_overrun, "finite and >= 1");
  safety.validate();
  require_positive(stop_time, "torque controller: stop_time");
  require_positive(stop_damping, "torque controller: stop_damping");
  require(position_margin >= 0.0, "torque controller: position_margin", position_margin, ">= 0");
  for (int i = 0; i < nv; ++i) {
    const double width = robot.limits().upper[i] - robot.limits().lower[i];
    if (!(2.0 * position_margin < width) && position_margin > 0.0) {
      throw std::invalid_argument("torque controller: position_margin is " + std::to_string(position_margin) +
                                  ", must be less than half of the range " + std::to_string(width) + " of joint '" +
                                  robot.coordinate_names()[static_cast<std::size_t>(i)] + "'");
    }
  }
}

TorqueController::TorqueController(const Robot& robot, TorqueControllerSettings settings)
    : nv_(robot.num_coordinates()),
      settings_((settings.validate(robot), std::move(settings))),
      limits_(robot.limits()),
      tracking_weight_(expanded(settings_.tracking_weight, nv_)),
      torque_cost_(expanded(settings_.torque_weight, nv_).cwiseQuotient(limits_.effort.cwiseAbs2())),
      bounds_(nv_),
      rows_(nv_, settings_.safety),
      hard_data_(nv_, nv_ + rows_.max_size()),
      hard_(nv_, nv_ + rows_.max_size()),
      rows_used_(static_cast<std::size_t>(rows_.max_size())),
      comfort_data_(2 * nv_, 3 * nv_ + rows_.max_size()),
      comfort_(2 * nv_, 3 * nv_ + rows_.max_size()),
      widening_data_(2 * nv_, 2 * nv_),
      widening_(2 * nv_, 2 * nv_),
      allowed_(Eigen::VectorXd::Zero(rows_.max_size())),
      row_multipliers_(Eigen::VectorXd::Zero(rows_.max_size())),
      wide_lower_(Eigen::VectorXd::Zero(nv_)),
      wide_upper_(Eigen::VectorXd::Zero(nv_)),
      mass_(Eigen::MatrixXd::Zero(nv_, nv_)),
      mass_cholesky_(Eigen::MatrixXd::Zero(nv_, nv_)),
      velocity_(Eigen::VectorXd::Zero(nv_)),
      wanted_(Eigen::VectorXd::Zero(nv_)),
      bias_(Eigen::VectorXd::Zero(nv_)) {
  // Over x = (q̈, s): q̈ - s <= upper, q̈ + s >= lower, the torque rows, normals q̈ >= lower; s >= 0.
  comfort_data_.A.topLeftCorner(nv_, nv_).setIdentity();
  comfort_data_.A.block(0, nv_, nv_, nv_).diagonal().setConstant(-1.0);
  comfort_data_.A.block(nv_, 0, nv_, nv_).setIdentity();
  comfort_data_.A.block(nv_, nv_, nv_, nv_).setIdentity();
  comfort_data_.lower.tail(nv_).setZero();
  // Over x = (q̈, e): q̈ + e within the box, the torque rows.
  widening_data_.H.diagonal().head(nv_).setConstant(regularisation);
  widening_data_.A.topLeftCorner(nv_, nv_).setIdentity();
  widening_data_.A.topRightCorner(nv_, nv_).setIdentity();
  for (int num = fewest_rows; num < rows_.max_size(); num *= 2) {
    least_.emplace_back(nv_, num);
  }
  least_.emplace_back(nv_, rows_.max_size());
}

TorqueController::LeastShortfall::LeastShortfall(int nv, int num)
    : num_rows(num), data(nv + num, nv + num), program(nv + num, nv + num) {}

TorqueStatus TorqueController::solve(ConstVectorRef q,
                                     ConstVectorRef v,
                                     ConstVectorRef acceleration,
                                     const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix,
                                     ConstVectorRef bias, const Clearances* clearances,
                                     TorqueSolution& solution) noexcept {
  const auto usable = [this](const auto& x) { return x.size() == nv_ && x.allFinite(); };
  const bool q_known = usable(q), v_known = usable(v), wanted_known = usable(acceleration), bias_known = usable(bias);
  const bool clear = clearances == nullptr || rows_.usable(*clearances);
  bool mass_known = mass_matrix.rows() == nv_ && mass_matrix.cols() == nv_ && mass_matrix.allFinite();
  if (mass_known) {
    mass_ = mass_matrix;
    mass_known = factorise_mass();
  }
  solution.fault = !q_known        ? TorqueFault::position
                   : !v_known      ? TorqueFault::velocity
                   : !wanted_known ? TorqueFault::acceleration
                   : !mass_known   ? TorqueFault::mass_matrix
                   : !bias_known   ? TorqueFault::bias
                   : !clear        ? TorqueFault::clearances
                                   : TorqueFault::none;
  if (v_known) {
    velocity_ = v;
  } else {
    velocity_.setZero();
  }
  if (bias_known) {
    bias_ = bias;
  }
  solution.slack.setZero();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  if (q_known && v_known) {
    bounds_.update(limits_, q, v, settings_.period, settings_.position_margin);
    solution.lower = bounds_.lower;
    solution.upper = bounds_.upper;
  } else {
    solution.lower.setConstant(not_a_number);
    solution.upper.setConstant(not_a_number);
  }

  TorqueStatus status = TorqueStatus::fallback_invalid_input;
  rows_.clear();
  row_multipliers_.setZero();
  solution.num_safety_rows = 0;
  solution.dominant = -1;
  report_clearance(clearances, solution);
  if (q_known && v_known && mass_known && bias_known) {
    if (clearances != nullptr && clear) {
      // Without any effort limit the torque never is what braking lacks.
      const BrakingTorque braking{mass_cholesky_, bias_};
      const bool limited = limits_.effort.array().isFinite().any();
      rows_.update(*clearances, velocity_, limits_, bounds_, settings_.period, limited ? &braking : nullptr);
    }
    if (wanted_known && clear) {
      wanted_ = acceleration;
    } else {
      wanted_ = -velocity_ / settings_.stop_time;
    }
    if (solve_within_bounds(solution)) {
      const bool free = std::all_of(solution.active.begin(), solution.active.end(),
                                    [](Limit limit) { return limit == Limit::none; });
      status = free && row_multipliers_.isZero(0.0) ? TorqueStatus::ok : TorqueStatus::limited;
    } else {
      status = solve_relaxed(solution);
    }
    report_safety(solution);
    if (rows_.helpless >= 0 && status < TorqueStatus::relaxed_safety) {
      status = TorqueStatus::relaxed_safety;
    }
    if (solution.least_clearance < 0.0 && status < TorqueStatus::clearance_lost) {
      status = TorqueStatus::clearance_lost;
    }
    if (!(wanted_known && clear) && status != TorqueStatus::fallback_solver) {
      status = TorqueStatus::fallback_invalid_input;
    }
  } else {
    stop(mass_known, solution);
    if (!(mass_known && bias_known)) {
      solution.acceleration.setConstant(not_a_number);
    }
  }
  solution.status = status;
  ++counts_[static_cast<std::size_t>(status)];
  return status;
}

bool TorqueController::factorise_mass() noexcept {
  const double largest = mass_.cwiseAbs().maxCoeff();
  for (int j = 0; j < nv_; ++j) {
    for (int i = j + 1; i < nv_; ++i) {
      if (std::abs(mass_(i, j) - mass_(j, i)) > symmetry_tolerance * largest) {
        return false;
      }
    }
  }
  return cholesky(mass_, mass_cholesky_);
}

void TorqueController::add_active(int i, double at_upper, double at_lower, double at_effort,
                                  TorqueSolution& solution) const noexcept {
  const auto joint = static_cast<std::size_t>(i);
  solution.active[joint] = solution.active[joint] |
                           (at_upper > 0.0   ? bounds_.upper_limit[joint]
                            : at_lower < 0.0 ? bounds_.lower_limit[joint]
                                             : Limit::none) |
                           (at_effort > 0.0   ? Limit::torque_upper
                            : at_effort < 0.0 ? Limit::torque_lower
                                              : Limit::none);
}

bool TorqueController::solve_within_bounds(TorqueSolution& solution) noexcept {
  // H = Q + M R' M,  g = -Q a + M R' h   with R' = R / effort limit^2.
  for (int j = 0; j < nv_; ++j) {
    for (int i = j; i < nv_; ++i) {
      double value = i == j ? tracking_weight_[i] : 0.0;
      for (int k = 0; k < nv_; ++k) {
        value += mass_(k, i) * torque_cost_[k] * mass_(k, j);
      }
      hard_data_.H(i, j) = hard_data_.H(j, i) = value;
    }
  }
  for (int i = 0; i < nv_; ++i) {
    double value = -tracking_weight_[i] * wanted_[i];
    for (int k = 0; k < nv_; ++k) {
      value += mass_(k, i) * torque_cost_[k] * bias_[k];
    }
    hard_data_.g[i] = value;
  }
  hard_data_.lower = bounds_.lower;
  hard_data_.upper = bounds_.upper;
  hard_data_.A.topRows(nv_) = mass_;
  hard_data_.row_lower.head(nv_) = -limits_.effort - bias_;
  hard_data_.row_upper.head(nv_) = limits_.effort - bias_;
  hard_data_.row_lower.tail(rows_.max_size()).setConstant(-infinity);
  for (int k = 0; k < rows_.size(); ++k) {
    if (!rows_.satisfied_within(k, bounds_.lower, bounds_.upper)) {
      hard_data_.A.row(nv_ + k) = rows_.normals.row(k);
      hard_data_.row_lower[nv_ + k] = rows_.lower[k];
    }
  }
  if (hard_.solve(hard_data_) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = hard_.solution().cwiseMax(bounds_.lower).cwiseMin(bounds_.upper);  // rounding
  for (int k = 0; k < rows_.size(); ++k) {
    row_multipliers_[k] = std::max(-hard_.multipliers()[2 * nv_ + k], 0.0);
  }
  for (int i = 0; i < nv_; ++i) {
    const double at_bound = hard_.multipliers()[i];
    add_active(i, at_bound, at_bound, hard_.multipliers()[nv_ + i], solution);
  }
  return accept(solution);
}

void TorqueController::widen_bounds() noexcept {
  wide_lower_ = bounds_.lower;
  wide_upper_ = bounds_.upper;
  if (settings_.hard_bounds) {
    return;
  }
  // To the overruns, which end where position limits do, unless these need more.
  for (int i = 0; i < nv_; ++i) {
    const double most = settings_.acceleration_overrun * limits_.acceleration[i];
    const double fastest = settings_.velocity_overrun * limits_.velocity[i];
    const double up = std::max(most, bounds_.position_lower[i]), down = std::max(most, -bounds_.position_upper[i]);
    double upper = std::max(bounds_.upper[i], std::min((fastest - velocity_[i]) / settings_.period, up));
    double lower = std::min(bounds_.lower[i], std::max((-fastest - velocity_[i]) / settings_.period, -down));
    const double position_lower = std::min(bounds_.position_lower[i], upper);
    const double position_upper = std::max(bounds_.position_upper[i], lower);
    if (position_lower <= position_upper) {
      lower = std::max(lower, position_lower);
      upper = std::min(upper, position_upper);
    }
    wide_lower_[i] = lower;
    wide_upper_[i] = upper;
  }
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
  const double asked = rows_.lower[rows_used_[static_cast<std::size_t>(n)]], size = 1.0 + std::abs(asked);
  return rounded                                    ? asked - allowed_[n] - slack_tolerance * size
         : allowed_[n] > shortfall_tolerance * size ? asked - allowed_[n]
                                                    : asked;
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
    add_active(i, multipliers[i], multipliers[i], multipliers[nv_ + least.num_rows + i], solution);
  }
  return true;
}

bool TorqueController::find_least_shortfalls(TorqueSolution& solution) noexcept {
  LeastShortfall& least = *std::find_if(least_.begin(), least_.end() - 1,
                                        [this](const LeastShortfall& l) { return l.num_rows >= num_rows_used_; });
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
    data.H(nv_ + n, nv_ + n) = std::max(squared / (squared + least_gradient_squared) * share, regularisation);
  }
  allowed_.setZero();
  if (!solve_least(least, false, solution)) {
    // The torque does not reach the box: widen it by as little as that takes.
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
  data.H.diagonal().tail(nv_) = tracking_weight_;
  data.g.head(nv_) = hard_data_.g;
  data.g.tail(nv_).setConstant(settings_.slack_weight * steepest);
  data.lower.head(nv_) = wide_lower_;
  data.upper.head(nv_) = wide_upper_;
  data.row_upper.head(nv_) = bounds_.upper;
  data.row_lower.segment(nv_, nv_) = bounds_.lower;
  data.A.block(2 * nv_, 0, nv_, nv_) = mass_;
  data.row_lower.segment(2 * nv_, nv_) = hard_data_.row_lower.head(nv_);
  data.row_upper.segment(2 * nv_, nv_) = hard_data_.row_upper.head(nv_);
  data.row_lower.tail(rows_.max_size()).setConstant(-infinity);
  for (int n = 0; n < num_rows_used_; ++n) {
    const int row = rows_used_[static_cast<std::size_t>(n)], at = 3 * nv_ + n;
    data.A.row(at).head(nv_) = rows_.normals.row(row);
    data.row_lower[at] = lowered(n, rounded);
  }
  if (comfort_.solve(data) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = comfort_.solution().head(nv_);
  const Eigen::VectorXd& multipliers = comfort_.multipliers();
  const int first_row = 2 * nv_;  // multipliers of the bounds come before those of the rows
  for (int i = 0; i < nv_; ++i) {
    add_active(i, std::max(multipliers[i], multipliers[first_row + i]), std::min(multipliers[i], multipliers[first_row + nv_ + i]),
               multipliers[first_row + 2 * nv_ + i], solution);
  }
  for (int n = 0; n < num_rows_used_; ++n) {
    row_multipliers_[rows_used_[static_cast<std::size_t>(n)]] = std::max(-multipliers[first_row + 3 * nv_ + n], 0.0);
  }
  return accept(solution);
}

TorqueStatus TorqueController::solve_relaxed(TorqueSolution& solution) noexcept {
  widen_bounds();
  collect_rows();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  allowed_.setZero();
  const bool found = solve_comfort(false, solution) ||
                     (find_least_shortfalls(solution) &&
                      (solve_comfort(false, solution) || solve_comfort(true, solution) ||
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
  bool bounds_kept = true, safe = true;
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

void TorqueController::report_clearance(const Clearances* clearances, TorqueSolution& solution) const noexcept {
  solution.least_clearance = infinity;
  solution.least_coordinate = solution.least_nearest = -1;
  if (clearances == nullptr) {
    return;
  }
  const Eigen::Index num = std::min(clearances->nearest.size(), clearances->least.size());
  for (Eigen::Index k = 0; k < num; ++k) {
    if (clearances->nearest[k] >= 0 && clearances->least[k] < solution.least_clearance) {
      solution.least_clearance = clearances->least[k];
      solution.least_coordinate = static_cast<int>(k);
      solution.least_nearest = clearances->nearest[k];
    }
  }
}

void TorqueController::report_safety(TorqueSolution& solution) noexcept {
  solution.num_safety_rows = std::min(rows_.size(), static_cast<int>(solution.safety.size()));
  double largest = 0.0;
  for (int k = 0; k < solution.num_safety_rows; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double short_by = rows_.lower[k] - rows_.normals.row(k).dot(solution.acceleration.transpose());
    const bool rounding = short_by <= slack_tolerance * (1.0 + std::abs(rows_.lower[k]) + wanted_.norm());
    solution.safety[at] = {rows_.coordinates[at], rows_.nearest[at], k == rows_.along_path,
                           rows_.lengths[k] * rows_.lower[k], rounding ? 0.0 : rows_.lengths[k] * short_by,
                           row_multipliers_[k]};
    if (row_multipliers_[k] > largest) {
      largest = row_multipliers_[k];
      solution.dominant = k;
    }
  }
}

bool TorqueController::accept(TorqueSolution& solution) noexcept {
  solution.torque = bias_;
  for (int j = 0; j < nv_; ++j) {
    solution.torque += solution.acceleration[j] * mass_.col(j);
  }
  for (int i = 0; i < nv_; ++i) {
    const double effort = limits_.effort[i];
    if (!(std::abs(solution.torque[i]) <= effort * (1.0 + torque_tolerance))) {
      return false;
    }
    solution.torque[i] = std::clamp(solution.torque[i], -effort, effort);
  }
  return solution.torque.allFinite();
}

void TorqueController::stop(bool mass_known, TorqueSolution& solution) noexcept {
  solution.slack.setZero();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  solution.torque = bias_;
  if (mass_known) {
    for (int j = 0; j < nv_; ++j) {
      const double wanted = std::clamp(-velocity_[j] / settings_.stop_time, -limits_.acceleration[j],
                                       limits_.acceleration[j]);
      const bool bounded = solution.lower[j] <= solution.upper[j];  // not without a position
      const double braking = bounded ? std::clamp(wanted, solution.lower[j], solution.upper[j]) : wanted;
      solution.torque += braking * mass_.col(j);
    }
  } else {
    for (int i = 0; i < nv_; ++i) {
      const double derived = settings_.stop_damping * limits_.effort[i] / limits_.velocity[i];
      const double damping = std::isfinite(derived) && derived > 0.0 ? derived : unlimited_stop_damping;
      solution.torque[i] -= damping * velocity_[i];
    }
  }
  for (int i = 0; i < nv_; ++i) {
    const double wanted = solution.torque[i], effort = limits_.effort[i];
    solution.torque[i] = std::isfinite(wanted) ? std::clamp(wanted, -effort, effort) : 0.0;
    if (solution.torque[i] != wanted) {
      solution.active[static_cast<std::size_t>(i)] = wanted > 0.0 ? Limit::torque_upper : Limit::torque_lower;
    }
  }
  if (mass_known) {
    solution.acceleration = solution.torque - bias_;
    solve_in_place(mass_cholesky_, solution.acceleration);
  }
}

}  // namespace sidestep
