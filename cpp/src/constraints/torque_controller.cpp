#include "sidestep/constraints/torque_controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/finite.hpp"
#include "../math/settings.hpp"
#include "../math/cholesky.hpp"

namespace sidestep {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// A mass matrix that differs from its transpose by more than this fraction of its largest entry is not rounding but
// an error, for example a triangle that was never filled.
constexpr double symmetry_tolerance = 1e-6;
// The torque of a solved program is outside the effort limits by rounding at most; more than this fraction of the
// limit means that the solution is not one.
constexpr double torque_tolerance = 1e-6;
// The smallest program of least shortfalls; the next ones double.
constexpr int fewest_rows = 4;
// Damping [Nm s/rad | N s/m] of the stop for joints without an effort or a velocity limit to derive it from.
constexpr double unlimited_stop_damping = 1.0;

/// Whether anything comes nearer that is lost already.
bool lost_closes(const Clearances* clearances) noexcept {
  constexpr double creeping = 1e-4;  // [m/s]
  const Eigen::Index num = clearances == nullptr ? 0 : clearances->nearest.size();
  for (Eigen::Index k = 0; k < num; ++k) {
    if (clearances->nearest[k] >= 0 && clearances->least[k] < 0.0 && clearances->approach.rates[k] < -creeping) {
      return true;
    }
  }
  return false;
}

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
  require(velocity_overrun >= 1.0 && velocity_overrun < infinity, "torque controller: velocity_overrun", velocity_overrun,
          "finite and >= 1");
  require(acceleration_overrun >= 1.0 && acceleration_overrun < infinity, "torque controller: acceleration_overrun",
          acceleration_overrun, "finite and >= 1");
  safety.validate();
  require_positive(stop_time, "torque controller: stop_time");
  require_positive(stop_damping, "torque controller: stop_damping");
  require(position_margin >= 0.0, "torque controller: position_margin", position_margin, ">= 0");
  require(max_speed_rows >= 0, "torque controller: max_speed_rows", max_speed_rows, ">= 0");
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
      hard_data_(nv_, nv_ + rows_.max_size() + settings_.max_speed_rows),
      hard_(nv_, nv_ + rows_.max_size() + settings_.max_speed_rows),
      rows_used_(static_cast<std::size_t>(rows_.max_size())),
      num_slacks_(nv_ + (settings_.max_speed_rows > 0 ? 1 : 0)),
      comfort_data_(nv_ + num_slacks_, 3 * nv_ + rows_.max_size() + settings_.max_speed_rows),
      comfort_(nv_ + num_slacks_, 3 * nv_ + rows_.max_size() + settings_.max_speed_rows),
      widening_data_(2 * nv_, 2 * nv_),
      widening_(2 * nv_, 2 * nv_),
      allowed_(Eigen::VectorXd::Zero(rows_.max_size())),
      row_multipliers_(Eigen::VectorXd::Zero(rows_.max_size())),
      speed_multipliers_(Eigen::VectorXd::Zero(settings_.max_speed_rows)),
      wide_lower_(Eigen::VectorXd::Zero(nv_)),
      wide_upper_(Eigen::VectorXd::Zero(nv_)),
      jerk_lower_(wide_lower_),
      jerk_upper_(wide_lower_),
      mass_(Eigen::MatrixXd::Zero(nv_, nv_)),
      mass_cholesky_(Eigen::MatrixXd::Zero(nv_, nv_)),
      weighted_(Eigen::VectorXd::Zero(nv_)),
      position_(Eigen::VectorXd::Zero(nv_)),
      velocity_(position_),
      wanted_(Eigen::VectorXd::Zero(nv_)),
      bias_(Eigen::VectorXd::Zero(nv_)),
      rate_lower_(bias_),
      rate_upper_(bias_),
      torque_lower_(bias_),
      torque_upper_(bias_) {
  // Over x = (q̈, s): q̈ - s <= upper, q̈ + s >= lower, the torque rows, normals q̈ >= lower; s >= 0.
  comfort_data_.A.topLeftCorner(nv_, nv_).setIdentity();
  comfort_data_.A.block(0, nv_, nv_, nv_).diagonal().setConstant(-1.0);
  comfort_data_.A.block(nv_, 0, nv_, nv_).setIdentity();
  comfort_data_.A.block(nv_, nv_, nv_, nv_).setIdentity();
  comfort_data_.lower.tail(num_slacks_).setZero();
  // Over x = (q̈, e): q̈ + e within the box, the torque rows.
  widening_data_.A.topLeftCorner(nv_, nv_).setIdentity();
  widening_data_.A.topRightCorner(nv_, nv_).setIdentity();
  for (int num = fewest_rows; num < rows_.max_size(); num *= 2) {
    least_.emplace_back(nv_, num);
  }
  least_.emplace_back(nv_, rows_.max_size());
}

TorqueController::LeastShortfall::LeastShortfall(int nv, int num)
    : num_rows(num), data(nv + num, nv + num), program(nv + num, nv + num) {}

TorqueStatus TorqueController::solve(ConstVectorRef q, ConstVectorRef v, ConstVectorRef acceleration,
                                     const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix, ConstVectorRef bias,
                                     const Clearances* clearances, const SecondState& second, const LastCommand& last,
                                     TorqueSolution& solution, const SpeedRows* speed) noexcept {
  const auto usable = [this](const auto& x) { return x.size() == nv_ && all_finite(x); };
  const bool q_known = usable(q), v_known = usable(v), wanted_known = usable(acceleration), bias_known = usable(bias);
  const bool two = second.clearances != nullptr;
  const bool clear = (clearances == nullptr || rows_.usable(*clearances)) && (!two || rows_.usable(*second.clearances));
  bool mass_known = mass_matrix.rows() == nv_ && mass_matrix.cols() == nv_ && all_finite(mass_matrix);
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
  if (q_known) {
    position_ = q;
  }
  if (v_known) {
    velocity_ = v;
  } else {
    velocity_.setZero();
  }
  if (bias_known) {
    bias_ = bias;
  }
  const double share = mass_known && last.torque != nullptr ? jerk_share() : 1.0;
  jerk_share_ = share;
  acceleration_factor_ = last.acceleration_factor;
  solution.slack.setZero();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  if (q_known && v_known) {
    bounds_.update(limits_, q, v, settings_.period, {settings_.position_margin, share, last.acceleration_factor},
                   last.binds ? last.acceleration : nullptr);
    if (last.acceleration_factor > 1.0 && wanted_known) {
      bounds_.draw_in(limits_.acceleration, acceleration);
    }
    solution.lower = bounds_.lower;
    solution.upper = bounds_.upper;
  } else {
    solution.lower.setConstant(not_a_number);
    solution.upper.setConstant(not_a_number);
  }

  set_torque_window(last);
  TorqueStatus status = TorqueStatus::fallback_invalid_input;
  rows_.clear();
  row_multipliers_.setZero();
  speed_ = speed;
  speed_multipliers_.setZero();
  solution.speed_frame = -1;
  solution.speed_slack = 0.0;
  solution.num_safety_rows = 0;
  solution.dominant = -1;
  solution.least_clearance = infinity;
  solution.least_coordinate = solution.least_nearest = -1;
  report_clearance(clearances, solution);
  report_clearance(second.clearances, solution);
  if (q_known && v_known && mass_known && bias_known) {
    write_torque_rows(last);
    const bool keeps_rate = last.torque != nullptr && limits_.effort_rate.array().isFinite().any();
    const bool rates = keeps_rate && solution.least_clearance >= 0.0;
    if (keeps_rate && last.acceleration != nullptr) {
      jerk_lower_ = *last.acceleration - settings_.period * limits_.jerk;
      jerk_upper_ = *last.acceleration + settings_.period * limits_.jerk;
    }
    const bool lost = clear && solution.least_clearance < 0.0;
    const bool closes = lost && (lost_closes(clearances) || lost_closes(second.clearances));
    if (clearances != nullptr && clear) {
      // Without any effort limit the torque never is what braking lacks.
      const BrakingTorque braking{mass_, mass_cholesky_, bias_};
      const bool limited = limits_.effort.array().isFinite().any();
      const RateLimits next{jerk_lower_, jerk_upper_, rate_lower_, rate_upper_};
      const LastMotion motion{last.acceleration != nullptr ? *last.acceleration : velocity_, share, last.early && rates, closes,
                              keeps_rate ? &next : nullptr};
      const LastMotion* const before = last.acceleration != nullptr ? &motion : nullptr;
      rows_.update(*clearances, velocity_, limits_, bounds_, settings_.period, limited ? &braking : nullptr, before);
      if (two) {
        rows_.add(*second.clearances, *second.velocity, limits_, bounds_, settings_.period, limited ? &braking : nullptr,
                  before);
      }
    }
    if (last.decided != nullptr) {
      for (int k = 0; k < rows_.size(); ++k) {
        rows_.lower[k] = std::min(rows_.lower[k], rows_.normals.row(k).dot(last.decided->transpose()));
      }
    }
    if (wanted_known && clear) {
      wanted_ = acceleration;
    } else {
      wanted_ = -velocity_ / settings_.stop_time;
    }
    const bool smooth = last.acceleration != nullptr || last.torque != nullptr;
    if (!rates || last.acceleration == nullptr || !last.binds) {
      jerk_lower_.setConstant(-infinity);
      jerk_upper_.setConstant(infinity);
    }
    write_cost();
    bool solved = solve_within_bounds(bounds_.smooth_lower, bounds_.smooth_upper, true, solution), kept = true, back = false;
    if (!solved && smooth && solution.least_clearance >= 0.0 && rows_.draw_on_reserves(settings_.period)) {
      solved = solve_within_bounds(bounds_.smooth_lower, bounds_.smooth_upper, true, solution);
      back = solved && rows_.ask_for_ways_back();
      if (!solved) {
        rows_.ask_again();
      }
    }
    if (!solved && smooth) {
      // As near as can be to what jerk and torque rate allow: the task has no say in what is beyond. Jerk gives way, or the bounds of
      // a state that noise and disturbances change faster than torque may. The torque's rate stays, since motors take no other.
      wanted_ = wanted_.cwiseMax(bounds_.smooth_lower).cwiseMin(bounds_.smooth_upper);
      write_cost();
      kept = false;
      wide_lower_ = jerk_lower_.cwiseMax(bounds_.lower).cwiseMin(bounds_.upper);
      wide_upper_ = jerk_upper_.cwiseMin(bounds_.upper).cwiseMax(bounds_.lower);
      if (last.torque != nullptr && last.acceleration_factor > 1.0) {
        wide_upper_ = last.acceleration_factor * limits_.acceleration;
        wide_lower_ = -wide_upper_;
      }
      solved = solve_within_bounds(wide_lower_, wide_upper_, false, solution);
      if (!solved && last.torque != nullptr && !rates) {
        solved = solve_within_bounds(bounds_.lower, bounds_.upper, false, solution);
      }
    }
    if (solved && !back && !presses_for_lost()) {
      const bool free =
          std::all_of(solution.active.begin(), solution.active.end(), [](Limit limit) { return limit == Limit::none; });
      status = !kept                                                                    ? TorqueStatus::relaxed
               : free && row_multipliers_.isZero(0.0) && speed_multipliers_.isZero(0.0) ? TorqueStatus::ok
                                                                                        : TorqueStatus::limited;
    } else {
      if (solution.least_clearance < 0.0) {
        rows_.put_off_ways_back(settings_.period);
      }
      // Ways back share what the jerk limits leave; so do ways out while nothing of them closes, unless others need more.
      const bool waits = lost && !closes && smooth;
      status = solve_relaxed(back || waits, solution);
      if (waits && (status == TorqueStatus::fallback_solver || others_fall_short(solution))) {
        status = solve_relaxed(back, solution);
      }
      kept = kept && (back || !smooth);
      if (status < TorqueStatus::relaxed && !kept) {
        status = TorqueStatus::relaxed;
      }
    }
    if (last.acceleration != nullptr && last.binds) {
      report_jerk(solution);
    }
    report_safety(solution);
    report_speed(solution);
    if (solution.speed_slack > 0.0 && status < TorqueStatus::relaxed) {
      status = TorqueStatus::relaxed;
    }
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

double TorqueController::jerk_share() const noexcept {
  // |M j| T <= share of the rate: what is left is for the change of the bias.
  constexpr double of_rate = 0.8;
  double share = 1.0;
  for (int i = 0; i < nv_; ++i) {
    double most = 0.0;
    for (int j = 0; j < nv_; ++j) {
      if (std::isfinite(limits_.jerk[j])) {
        most += std::abs(mass_(i, j)) * limits_.jerk[j];
      }
    }
    if (most * share > of_rate * limits_.effort_rate[i]) {
      share = of_rate * limits_.effort_rate[i] / most;
    }
  }
  return share;
}

void TorqueController::set_torque_window(const LastCommand& last) noexcept {
  torque_lower_ = -limits_.effort;
  torque_upper_ = limits_.effort;
  if (last.torque == nullptr) {
    return;
  }
  for (int i = 0; i < nv_; ++i) {
    const double before = (*last.torque)[i], step = limits_.effort_rate[i] * settings_.period;
    torque_lower_[i] = std::clamp(before - step, -limits_.effort[i], limits_.effort[i]);
    torque_upper_[i] = std::clamp(before + step, -limits_.effort[i], limits_.effort[i]);
  }
}

void TorqueController::write_torque_rows(const LastCommand& last) noexcept {
  hard_data_.A.topRows(nv_) = mass_;
  rate_lower_ = -limits_.effort - bias_;
  rate_upper_ = limits_.effort - bias_;
  // Each window is clamped into those before it, so that a torque is left: effort, rate, and both again without gravity.
  const auto narrow = [this](int i, double lower, double upper) {
    const double least = rate_lower_[i], most = rate_upper_[i];
    rate_lower_[i] = std::clamp(lower, least, most);
    rate_upper_[i] = std::clamp(upper, rate_lower_[i], most);
  };
  for (int i = 0; i < nv_; ++i) {
    const double before = last.torque == nullptr ? 0.0 : (*last.torque)[i] - bias_[i];
    const double step = last.torque == nullptr ? infinity : limits_.effort_rate[i] * settings_.period;
    if (step < infinity) {
      narrow(i, before - step, before + step);
    }
    if (last.gravity != nullptr && std::abs((*last.gravity)[i]) < limits_.effort[i]) {
      const double g = (*last.gravity)[i];
      narrow(i, -limits_.effort[i] - bias_[i] + g, limits_.effort[i] - bias_[i] + g);
    }
    if (step < infinity && last.gravity_change != nullptr) {
      const double change = (*last.gravity_change)[i];
      narrow(i, before + change - step, before + change + step);
    }
  }
  hard_data_.row_lower.head(nv_) = rate_lower_;
  hard_data_.row_upper.head(nv_) = rate_upper_;
}

void TorqueController::add_active(int i, double at_upper, double at_lower, double at_effort, bool smooth,
                                  TorqueSolution& solution) const noexcept {
  const auto joint = static_cast<std::size_t>(i);
  const auto& upper = smooth ? bounds_.smooth_upper_limit : bounds_.upper_limit;
  const auto& lower = smooth ? bounds_.smooth_lower_limit : bounds_.lower_limit;
  const bool by_rate_up = hard_data_.row_upper[i] < limits_.effort[i] - bias_[i];
  const bool by_rate_down = hard_data_.row_lower[i] > -limits_.effort[i] - bias_[i];
  solution.active[joint] = solution.active[joint] |
                           (at_upper > 0.0   ? upper[joint]
                            : at_lower < 0.0 ? lower[joint]
                                             : Limit::none) |
                           (at_effort > 0.0   ? by_rate_up ? Limit::torque_rate_upper : Limit::torque_upper
                            : at_effort < 0.0 ? by_rate_down ? Limit::torque_rate_lower : Limit::torque_lower
                                              : Limit::none);
}

void TorqueController::write_cost() noexcept {
  // H = Q + M R' M,  g = -Q a + M R' h   with R' = R / effort limit^2.
  with_size(nv_, [&](auto nv) {
    auto weighted = sized(weighted_, nv);
    const auto bias = sized(bias_, nv);
    for (Eigen::Index i = 0; i < nv; ++i) {
      weighted = sized(mass_.col(i), nv).cwiseProduct(sized(torque_cost_, nv));
      for (Eigen::Index j = 0; j <= i; ++j) {
        const auto column = sized(mass_.col(j), nv);
        double value = i == j ? tracking_weight_[i] : 0.0;
        for (Eigen::Index k = 0; k < nv; ++k) {
          value += weighted[k] * column[k];
        }
        hard_data_.H(i, j) = hard_data_.H(j, i) = value;
      }
      double value = -tracking_weight_[i] * wanted_[i];
      for (Eigen::Index k = 0; k < nv; ++k) {
        value += weighted[k] * bias[k];
      }
      hard_data_.g[i] = value;
    }
  });
}

int TorqueController::num_speed_rows() const noexcept {
  return speed_ == nullptr ? 0 : std::min(speed_->size(), settings_.max_speed_rows);
}

void TorqueController::write_speed_rows(QuadraticProgramData& data, int first, int slack, const Eigen::VectorXd& lower,
                                        const Eigen::VectorXd& upper) const noexcept {
  data.row_upper.segment(first, settings_.max_speed_rows).setConstant(infinity);
  for (int k = 0; k < num_speed_rows(); ++k) {
    if (!speed_->satisfied_within(k, lower, upper)) {
      data.A.row(first + k).head(nv_) = speed_->normals.row(k);
      data.row_upper[first + k] = speed_->upper[k];
      if (slack >= 0) {
        data.A(first + k, slack) = -1.0 / speed_->lengths[k];
      }
    }
  }
}

bool TorqueController::solve_within_bounds(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, bool smooth,
                                           TorqueSolution& solution) noexcept {
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  row_multipliers_.setZero();
  speed_multipliers_.setZero();
  hard_data_.lower = lower;
  hard_data_.upper = upper;
  hard_data_.row_lower.segment(nv_, rows_.max_size()).setConstant(-infinity);
  for (int k = 0; k < rows_.size(); ++k) {
    if (!rows_.satisfied_within(k, lower, upper)) {
      hard_data_.A.row(nv_ + k) = rows_.normals.row(k);
      hard_data_.row_lower[nv_ + k] = rows_.lower[k];
    }
  }
  write_speed_rows(hard_data_, nv_ + rows_.max_size(), -1, lower, upper);
  if (hard_.solve(hard_data_) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = hard_.solution().cwiseMax(lower).cwiseMin(upper);  // rounding
  for (int k = 0; k < rows_.size(); ++k) {
    row_multipliers_[k] = std::max(-hard_.multipliers()[2 * nv_ + k], 0.0);
  }
  for (int k = 0; k < num_speed_rows(); ++k) {
    speed_multipliers_[k] = std::max(hard_.multipliers()[2 * nv_ + rows_.max_size() + k], 0.0);
  }
  for (int i = 0; i < nv_; ++i) {
    const double at_bound = hard_.multipliers()[i];
    add_active(i, at_bound, at_bound, hard_.multipliers()[nv_ + i], smooth, solution);
  }
  return accept(solution);
}

void TorqueController::report_clearance(const Clearances* clearances, TorqueSolution& solution) const noexcept {
  if (clearances == nullptr) {
    return;
  }
  const Eigen::Index num = std::min({clearances->nearest.size(), clearances->least.size(), clearances->values.size()});
  for (Eigen::Index k = 0; k < num; ++k) {
    const double value = clearances->least[k];
    if (clearances->nearest[k] >= 0 && value < solution.least_clearance) {
      solution.least_clearance = value;
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
    solution.safety[at] = {rows_.coordinates[at],
                           rows_.nearest[at],
                           rows_.along_path[at] != 0,
                           rows_.lengths[k] * rows_.lower[k],
                           rounding ? 0.0 : rows_.lengths[k] * short_by,
                           row_multipliers_[k]};
    if (row_multipliers_[k] > largest) {
      largest = row_multipliers_[k];
      solution.dominant = k;
    }
  }
}

void TorqueController::report_speed(TorqueSolution& solution) const noexcept {
  double largest = 0.0;
  for (int k = 0; k < num_speed_rows(); ++k) {
    const double over = speed_->normals.row(k).dot(solution.acceleration.transpose()) - speed_->upper[k];
    const bool rounding = over <= slack_tolerance * (1.0 + std::abs(speed_->upper[k]) + wanted_.norm());
    const double slack = rounding ? 0.0 : speed_->lengths[k] * over;
    if (slack > solution.speed_slack || (solution.speed_slack == 0.0 && speed_multipliers_[k] > largest)) {
      solution.speed_slack = slack;
      solution.speed_frame = speed_->frames[static_cast<std::size_t>(k)];
      largest = speed_multipliers_[k];
    }
  }
}

void TorqueController::report_jerk(TorqueSolution& solution) const noexcept {
  for (int i = 0; i < nv_; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const double x = solution.acceleration[i], rounding = slack_tolerance * (1.0 + std::abs(x));
    if (x > bounds_.smooth_upper[i] + rounding && bounds_.smooth_upper_limit[joint] == Limit::jerk_upper) {
      solution.active[joint] = solution.active[joint] | Limit::jerk_upper;
    } else if (x < bounds_.smooth_lower[i] - rounding && bounds_.smooth_lower_limit[joint] == Limit::jerk_lower) {
      solution.active[joint] = solution.active[joint] | Limit::jerk_lower;
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
      const double wanted = std::clamp(-velocity_[j] / settings_.stop_time, -limits_.acceleration[j], limits_.acceleration[j]);
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
    solution.torque[i] = std::clamp(std::isfinite(wanted) ? wanted : 0.0, torque_lower_[i], torque_upper_[i]);
    if (solution.torque[i] != wanted) {
      const bool up = !(wanted <= 0.0), by_rate = up ? torque_upper_[i] < effort : torque_lower_[i] > -effort;
      solution.active[static_cast<std::size_t>(i)] =
          by_rate ? (wanted > solution.torque[i] ? Limit::torque_rate_upper : Limit::torque_rate_lower)
          : up    ? Limit::torque_upper
                  : Limit::torque_lower;
    }
  }
  if (mass_known) {
    solution.acceleration = solution.torque - bias_;
    solve_in_place(mass_cholesky_, solution.acceleration);
  }
}

}  // namespace sidestep
