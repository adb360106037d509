#include "sidestep/control/torque_controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "cholesky.hpp"

namespace sidestep {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// A mass matrix that differs from its transpose by more than this fraction of its largest entry is not rounding but
// an error, for example a triangle that was never filled.
constexpr double symmetry_tolerance = 1e-6;
// The torque of a solved program is outside the effort limits by rounding at most; more than this fraction of the
// limit means that the solution is not one.
constexpr double torque_tolerance = 1e-6;
// Slack below this, relative to 1 /s^2 plus the bound, is rounding of the second program and not worth a status.
constexpr double slack_tolerance = 1e-9;
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

void check_positive(double value, const char* setting) {
  if (!(value > 0.0) || value == infinity) {
    throw std::invalid_argument(std::string("torque controller: ") + setting + " is " + std::to_string(value) +
                                ", must be finite and positive");
  }
}

}  // namespace

const char* name(TorqueStatus status) noexcept {
  switch (status) {
    case TorqueStatus::ok: return "ok";
    case TorqueStatus::limited: return "limited";
    case TorqueStatus::relaxed: return "relaxed";
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
  }
  return "unknown";
}

TorqueSolution::TorqueSolution(int num_coordinates)
    : torque(Eigen::VectorXd::Zero(num_coordinates)),
      acceleration(Eigen::VectorXd::Zero(num_coordinates)),
      slack(Eigen::VectorXd::Zero(num_coordinates)),
      lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      active(static_cast<std::size_t>(num_coordinates), Limit::none) {}

void TorqueControllerSettings::validate(const Robot& robot) const {
  const int nv = robot.num_coordinates();
  check_positive(period, "period");
  check_weight(tracking_weight, "tracking_weight", nv, false);
  check_weight(torque_weight, "torque_weight", nv, true);
  check_positive(slack_weight, "slack_weight");
  check_positive(stop_time, "stop_time");
  check_positive(stop_damping, "stop_damping");
  if (!(position_margin >= 0.0)) {
    throw std::invalid_argument("torque controller: position_margin is " + std::to_string(position_margin) +
                                ", must be >= 0");
  }
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
      hard_data_(nv_, nv_),
      relaxed_data_(2 * nv_, 3 * nv_),
      hard_(nv_, nv_),
      relaxed_(2 * nv_, 3 * nv_),
      mass_(Eigen::MatrixXd::Zero(nv_, nv_)),
      mass_cholesky_(Eigen::MatrixXd::Zero(nv_, nv_)),
      velocity_(Eigen::VectorXd::Zero(nv_)),
      wanted_(Eigen::VectorXd::Zero(nv_)),
      bias_(Eigen::VectorXd::Zero(nv_)) {
  // Second program, over (q̈, s): rows q̈ - s <= upper, q̈ + s >= lower, then the torque rows; s >= 0.
  relaxed_data_.A.topLeftCorner(nv_, nv_).setIdentity();
  relaxed_data_.A.block(0, nv_, nv_, nv_).diagonal().setConstant(-1.0);
  relaxed_data_.A.block(nv_, 0, nv_, nv_).setIdentity();
  relaxed_data_.A.block(nv_, nv_, nv_, nv_).setIdentity();
  relaxed_data_.lower.tail(nv_).setZero();
  relaxed_data_.H.bottomRightCorner(nv_, nv_).diagonal() = tracking_weight_;
}

TorqueStatus TorqueController::solve(const Eigen::Ref<const Eigen::VectorXd>& q,
                                     const Eigen::Ref<const Eigen::VectorXd>& v,
                                     const Eigen::Ref<const Eigen::VectorXd>& acceleration,
                                     const Eigen::Ref<const Eigen::MatrixXd>& mass_matrix,
                                     const Eigen::Ref<const Eigen::VectorXd>& bias, TorqueSolution& solution) noexcept {
  const auto usable = [this](const auto& x) { return x.size() == nv_ && x.allFinite(); };
  const bool q_known = usable(q), v_known = usable(v), wanted_known = usable(acceleration), bias_known = usable(bias);
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
  if (q_known && v_known && mass_known && bias_known) {
    if (wanted_known) {
      wanted_ = acceleration;
    } else {
      wanted_ = -velocity_ / settings_.stop_time;
    }
    if (solve_within_bounds(solution)) {
      const bool free = std::all_of(solution.active.begin(), solution.active.end(),
                                    [](Limit limit) { return limit == Limit::none; });
      status = free ? TorqueStatus::ok : TorqueStatus::limited;
    } else if (solve_relaxed(solution)) {
      status = solution.slack.isZero(0.0) ? TorqueStatus::limited : TorqueStatus::relaxed;
    } else {
      stop(true, solution);
      status = TorqueStatus::fallback_solver;
    }
    if (!wanted_known && status != TorqueStatus::fallback_solver) {
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
  hard_data_.A = mass_;
  hard_data_.row_lower = -limits_.effort - bias_;
  hard_data_.row_upper = limits_.effort - bias_;
  if (hard_.solve(hard_data_) != QuadraticProgramStatus::solved) {
    return false;
  }
  solution.acceleration = hard_.solution();
  for (int i = 0; i < nv_; ++i) {
    const double at_bound = hard_.multipliers()[i], at_effort = hard_.multipliers()[nv_ + i];
    const auto joint = static_cast<std::size_t>(i);
    solution.active[joint] = (at_bound > 0.0   ? bounds_.upper_limit[joint]
                              : at_bound < 0.0 ? bounds_.lower_limit[joint]
                                               : Limit::none) |
                             (at_effort > 0.0   ? Limit::torque_upper
                              : at_effort < 0.0 ? Limit::torque_lower
                                                : Limit::none);
  }
  return accept(solution);
}

bool TorqueController::solve_relaxed(TorqueSolution& solution) noexcept {
  double steepest = 0.0;
  for (int i = 0; i < nv_; ++i) {
    const double nearest = std::clamp(wanted_[i], bounds_.lower[i], bounds_.upper[i]);
    steepest = std::max(steepest, tracking_weight_[i] * (1.0 + std::abs(wanted_[i] - nearest)));
  }
  relaxed_data_.H.topLeftCorner(nv_, nv_) = hard_data_.H;
  relaxed_data_.g.head(nv_) = hard_data_.g;
  relaxed_data_.g.tail(nv_).setConstant(settings_.slack_weight * steepest);
  relaxed_data_.row_upper.head(nv_) = bounds_.upper;
  relaxed_data_.row_lower.segment(nv_, nv_) = bounds_.lower;
  relaxed_data_.A.bottomLeftCorner(nv_, nv_) = mass_;
  relaxed_data_.row_lower.tail(nv_) = hard_data_.row_lower;
  relaxed_data_.row_upper.tail(nv_) = hard_data_.row_upper;
  if (relaxed_.solve(relaxed_data_) != QuadraticProgramStatus::solved) {
    return false;
  }
  const auto multipliers = relaxed_.multipliers().tail(3 * nv_);
  for (int i = 0; i < nv_; ++i) {
    const double q_ddot = relaxed_.solution()[i];
    const double outside = q_ddot - std::clamp(q_ddot, bounds_.lower[i], bounds_.upper[i]);
    const double bound = outside > 0.0 ? bounds_.upper[i] : bounds_.lower[i];
    const bool rounding = std::abs(outside) <= slack_tolerance * (1.0 + std::abs(bound));
    solution.acceleration[i] = q_ddot;
    solution.slack[i] = rounding ? 0.0 : outside;
    const auto joint = static_cast<std::size_t>(i);
    const double at_effort = multipliers[2 * nv_ + i];
    solution.active[joint] = (multipliers[i] > 0.0         ? bounds_.upper_limit[joint]
                              : multipliers[nv_ + i] < 0.0 ? bounds_.lower_limit[joint]
                                                           : Limit::none) |
                             (at_effort > 0.0   ? Limit::torque_upper
                              : at_effort < 0.0 ? Limit::torque_lower
                                                : Limit::none);
  }
  return accept(solution);
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
      const double braking = std::clamp(-velocity_[j] / settings_.stop_time, -limits_.acceleration[j],
                                        limits_.acceleration[j]);
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
    // M^-1 (torque - bias) by the two triangular solves of the Cholesky factor.
    solution.acceleration = solution.torque - bias_;
    for (int i = 0; i < nv_; ++i) {
      solution.acceleration[i] -= mass_cholesky_.row(i).head(i).dot(solution.acceleration.head(i));
      solution.acceleration[i] /= mass_cholesky_(i, i);
    }
    for (int i = nv_ - 1; i >= 0; --i) {
      const int below = nv_ - 1 - i;
      solution.acceleration[i] -= mass_cholesky_.col(i).tail(below).dot(solution.acceleration.tail(below));
      solution.acceleration[i] /= mass_cholesky_(i, i);
    }
  }
}

}  // namespace sidestep
