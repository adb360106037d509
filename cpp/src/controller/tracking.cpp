// The reference that the controller integrates, the arm's tracking of it, and what disturbs the arm.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "../math/cholesky.hpp"
#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double close = 0.003;         // to the reference [rad | m]: feedback keeps the acceleration limits
constexpr double feedback_room = 20.0;  // of accelerations elsewhere: dry friction on a light wrist takes so much
constexpr double impedance_room = 1e3;  // of accelerations that an impedance asks for: of light joints, and by impacts
constexpr double like_reference = 0.1;  // of the acceleration limits, by which feedback may differ [-]
constexpr double jitter = 0.1;          // of measured velocities, at rest [rad/s | m/s]
constexpr double of_rate = 0.5;         // of the torque's rate, that feedback asks for [-]
constexpr double free_share = 0.2;      // of the largest error, from which the arm draws the reference to itself [-]
constexpr double sliding_share = 0.2;   // of the largest error, of joints that slide [m/rad]

}  // namespace

bool Controller::Impl::take_state(ConstVectorRef q, ConstVectorRef v) noexcept {
  impossible_ = {};
  if (q.size() != q_.size() || v.size() != q_.size() || !q.allFinite() || !v.allFinite()) {
    return false;
  }
  if (!plausible_before_) {  // a state in another unit must not move the arm in the first steps
    impossible_ = plausible_.impossible(q, v);
    if (impossible_.joint >= 0) {
      return false;
    }
    plausible_before_ = true;
  }
  arm_q_ = q;
  arm_v_ = v;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    if (!is_unlimited_[static_cast<std::size_t>(j)]) {
      continue;
    }
    // An encoder that wraps at a turn: no velocity explains a jump of more than half of one.
    arm_q_[j] += turns_[j];
    if (known_before_) {
      const double turn = 2.0 * std::numbers::pi * std::round((last_arm_q_[j] - arm_q_[j]) / (2.0 * std::numbers::pi));
      turns_[j] += turn;
      arm_q_[j] += turn;
    }
  }
  return true;
}

void Controller::Impl::begin_reference() noexcept {
  // An arm whose velocities only jitter is at rest.
  next_q_ = arm_q_;
  next_v_ = arm_v_.unaryExpr([](double v) { return std::abs(v) < jitter ? 0.0 : v; });
  a_.setZero();
  smooth_a_.setZero();
  failsafe_.reset();
  if (!torque) {
    return;
  }
  if (has_last_torque_) {
    reference_torque_ = last_torque_;
  } else if (dynamics_) {  // what has held the arm until now, nobody knows: what would hold it
    dynamics_->bias(arm_q_, arm_v_, *dynamics_workspace_, reference_torque_);
    const double left = 1.0 - settings.effort_margin;  // more than there is has held it no more than all there is
    const Eigen::VectorXd& effort = arm.robot().limits().effort;
    reference_torque_ = reference_torque_.cwiseMax(-left * effort).cwiseMin(left * effort);
    last_torque_ = reference_torque_;
    has_last_torque_ = true;
  }
}

void Controller::Impl::follow_arm() noexcept {
  const bool begins = !known_before_ || begins_anew_;
  const double most = drives_track_ ? settings.tracking.servo_lag : settings.tracking.largest_error;
  if (begins && known_before_) {
    begin_anew();
  } else if (begins) {
    begins_anew_ = false;
    begin_reference();
  }
  command.tracking_error = begins ? 0.0 : (next_q_ - arm_q_).cwiseAbs().maxCoeff();
  q_ = next_q_;
  v_ = next_v_;
  coupling_.setZero();
  if (!drives_track_) {
    // What the arm cannot follow is not run away from.
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      const double error = arm_q_[j] - q_[j], share = is_impedance() ? 1.0 : free_share;
      const double free = share * most * (is_sliding_[static_cast<std::size_t>(j)] ? sliding_share : 1.0);
      coupling_[j] = frequency_ * frequency_ * (error - std::clamp(error, -free, free));
    }
  }
  apart_ = q_ != arm_q_ || v_ != arm_v_;
  if (apart_ && !begins) {
    // Noise is filtered: the velocity that was predicted, drawn to the measured one.
    const double share = measurement_.takes_velocity ? 1.0 : std::min(1.0, settings.period / settings.tracking.velocity_filter);
    expected_v_ = last_arm_v_ + settings.period * last_acceleration_;
    arm_v_ = expected_v_ + share * (arm_v_ - expected_v_);
  }
}

void Controller::Impl::observe() noexcept {
  if (!known_before_ || begins_anew_) {
    last_measured_v_ = arm_v_;
  } else if (observer_) {
    observer_->update(last_measured_v_, arm_v_, last_torque_, last_acceleration_, model_mass_, model_bias_);
    last_measured_v_ = arm_v_;
  }
}

void Controller::Impl::take_dynamics(const KinematicState& state, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                                     const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept {
  // Without inertias of its own, an arm has to be told them in every step.
  if (mass_matrix != nullptr) {
    const bool fits =
        mass_matrix->rows() == mass_.rows() && mass_matrix->cols() == mass_.cols() && bias->size() == bias_.size();
    if (fits) {
      mass_ = *mass_matrix;
      bias_ = *bias;
    } else {
      mass_.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  } else if (dynamics_) {
    dynamics_->mass_matrix(state, *dynamics_workspace_, mass_);
    dynamics_->bias(state, *dynamics_workspace_, bias_);
  } else {
    mass_.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  model_mass_ = mass_;
  model_bias_ = bias_;
  if (observer_) {
    mass_.diagonal() += observer_->rotors();
    bias_ -= observer_->disturbance();
  }
}

LastCommand Controller::Impl::last_command(const Eigen::VectorXd* acceleration, const Eigen::VectorXd* of_torque, double factor,
                                           bool binds) const noexcept {
  return {acceleration,
          has_last_torque_ ? of_torque : nullptr,
          dynamics_ ? &gravity_ : nullptr,
          dynamics_ ? &gravity_change_ : nullptr,
          factor,
          binds};
}

void Controller::Impl::solve_reference(const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                                       const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept {
  SecondState second;
  if (apart_) {
    arm_workspace_.activations = workspace.activations;
    if (system->embed(arm_q_, arm_v_, obstacles(), arm_workspace_)) {
      second = {&closing_.corrected(arm_workspace_.clearances, arm_corrected_), &arm_v_};
    }
  }
  if (torque && dynamics_) {
    dynamics_->gravity(apart_ ? arm_workspace_.state() : workspace.state(), *dynamics_workspace_, gravity_change_);
    gravity_change_.swap(gravity_);
    gravity_change_ = gravity_ - gravity_change_;
    if (!known_before_) {
      gravity_change_.setZero();
    }
  }
  LastCommand last{&smooth_a_};
  if (torque) {
    last = last_command(&smooth_a_, &reference_torque_, 1.0, true);
  }
  last.early = torque && !avoiding_;
  limit_speed();
  const SpeedRows* const speed = settings.speed_limits ? &speed_rows_ : nullptr;
  const Clearances& clearances = closing_.corrected(workspace.clearances, corrected_);
  if (torque) {
    // The arm's own mass matrix is that where it is: the reference's is the model's, where there is one.
    const bool told = mass_matrix != nullptr && (!apart_ || !dynamics_);
    take_dynamics(workspace.state(), told ? mass_matrix : nullptr, told ? bias : nullptr);
    command.program = torque_program_->solve(q_, v_, wanted_, mass_, bias_, &clearances, second, last, solution, speed);
    reference_torque_ = solution.torque;
  } else {
    command.program = filter_->apply(q_, v_, wanted_, &clearances, second, last, solution, speed);
  }
}

void Controller::Impl::keep_failsafe() noexcept {
  // Beside what moves a stop would only wait for it; and the way out of what is lost comes before the jerk.
  if (disturbed_ || avoiding_ || solution.least_clearance < 0.0 || !solution.acceleration.allFinite()) {
    failsafe_.reset();
    return;
  }
  const StopTorque taken{mass_, bias_, torque ? torque_program_->jerk_share() : 1.0};
  if (!failsafe_.keep(q_, v_, smooth_a_, obstacles(), torque ? &taken : nullptr, solution.acceleration)) {
    return;
  }
  solution.slack.setZero();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  if (torque) {
    taken.of(solution.acceleration, solution.torque);
    reference_torque_ = solution.torque;
  }
  command.program = TorqueStatus::limited;
}

double Controller::Impl::feedback_frequency() noexcept {
  // Under a feedback that asks for more, motors that change their torque slowly would shake: ω³ |M e| and ω² |M de/dt| keep a
  // share of the rate.
  double w = frequency_;
  if (torque) {
    const Eigen::VectorXd& rate = arm.robot().limits().effort_rate;
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      double error = 0.0, change = 0.0;
      for (Eigen::Index k = 0; k < q_.size(); ++k) {
        error += mass_(j, k) * (q_[k] - arm_q_[k]);
        change += mass_(j, k) * (v_[k] - arm_v_[k]);
      }
      w = std::min({w, std::cbrt(of_rate * rate[j] / std::abs(error)), std::sqrt(of_rate * rate[j] / std::abs(change))});
    }
  }
  return w;
}

void Controller::Impl::track(const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                             const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept {
  if (!apart_ || drives_track_) {
    tracked_.torque = solution.torque;
    tracked_.acceleration = solution.acceleration;
    return;
  }
  if (torque) {
    take_dynamics(arm_workspace_.state(), mass_matrix, bias);
  }
  if (is_impedance()) {
    write_impedance();
  } else {
    const double w = feedback_frequency();
    feedback_ = a_ + w * w * (q_ - arm_q_) + 2.0 * settings.tracking.damping * w * (v_ - arm_v_);
  }
  const SpeedRows* const speed = settings.speed_limits ? &arm_speed_rows_ : nullptr;
  // The reference's acceleration meets the clearances of the arm too, as far as possible. They are asked again where feedback wants
  // something else, for no more than that acceleration gives them; and where one is lost, which the torque's rate gives way to.
  const bool as_reference =
      command.program != TorqueStatus::clearance_lost &&
      ((feedback_ - a_).cwiseAbs().array() < like_reference * arm.robot().limits().acceleration.array()).all();
  const Clearances* const clearances = as_reference ? nullptr : &closing_.corrected(arm_workspace_.clearances, arm_corrected_);
  TorqueStatus status;
  if (torque) {
    const double room = is_impedance() ? impedance_room : command.tracking_error < close ? 1.0 : feedback_room;
    LastCommand last = last_command(&last_acceleration_, &last_torque_, room, false);
    last.decided = &a_;
    status = tracking_program_->solve(arm_q_, arm_v_, feedback_, mass_, bias_, clearances, {}, last, tracked_, speed);
  } else {
    LastCommand last{&last_acceleration_};
    last.decided = &a_;
    status = tracking_filter_->apply(arm_q_, arm_v_, feedback_, clearances, {}, last, tracked_, speed);
  }
  if (status > TorqueStatus::limited) {
    command.program = std::max(command.program, status);
  }
}

void Controller::Impl::write_impedance() noexcept {
  // M a_r + K e + D de/dt + h is sent, e = q_r − q, with the h of the model: limits and clearances know of the disturbance d, which is
  // in the bias by now, the impedance does not make up for it. With M = L Lᵀ and L⁻¹ K L⁻ᵀ = U Λ Uᵀ the damping of all modes is ζ if
  // D = 2ζ L U √Λ Uᵀ Lᵀ.
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_of_impedance, 1>;
  feedback_ = a_;
  if (!cholesky(mass_, mass_cholesky_)) {
    return;
  }
  const Eigen::Index n = q_.size();
  Vector K(n), force(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double scale = is_sliding_[static_cast<std::size_t>(j)] ? 1.0 / sliding_share : 1.0;
    K[j] = scale * settings.tracking.stiffness * arm.robot().limits().effort[j];
    force[j] = K[j] * (q_[j] - arm_q_[j]) + (observer_ ? observer_->disturbance()[j] : 0.0);
  }
  const Small L = mass_cholesky_;
  const auto lower = L.triangularView<Eigen::Lower>();
  Small B = K.cwiseSqrt().asDiagonal();
  lower.solveInPlace(B);
  modes_.compute(B.lazyProduct(B.transpose()));
  Vector rate = v_ - arm_v_;
  rate = lower.transpose() * rate;
  const Vector modal = modes_.eigenvalues().cwiseMax(0.0).cwiseSqrt().cwiseProduct(modes_.eigenvectors().transpose() * rate);
  lower.solveInPlace(force);
  force += 2.0 * settings.tracking.damping * (modes_.eigenvectors() * modal);
  lower.transpose().solveInPlace(force);
  feedback_ += force;
}

void Controller::Impl::stop(const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix, const Eigen::Ref<const Eigen::VectorXd>* bias,
                            ConstVectorRef q, ConstVectorRef v) noexcept {
  measurement_.unusable = true;
  if (drives_track_ && known_before_) {  // which follow the reference, wherever the arm is: it comes to rest
    q_ = next_q_;
    v_ = next_v_;
    wanted_ = -v_ / settings.stop_time;
    static_cast<void>(filter_->apply(q_, v_, wanted_, nullptr, {}, LastCommand{&smooth_a_}, tracked_));
    solution.acceleration = tracked_.acceleration;
    solution.fault = q.size() == q_.size() && q.allFinite() ? TorqueFault::velocity : TorqueFault::position;
    command.program = TorqueStatus::fallback_invalid_input;
    failsafe_.reset();
    advance_reference();
    return;
  }
  wanted_.setZero();
  const LastCommand last{nullptr, has_last_torque_ ? &last_torque_ : nullptr};
  if (torque && mass_matrix != nullptr && bias->size() == bias_.size() && bias->allFinite()) {
    command.program = torque_program_->solve(q, v, wanted_, *mass_matrix, *bias, nullptr, {}, last, solution);
  } else if (torque) {
    command.program = torque_program_->solve(q, v, wanted_, mass_, bias_, nullptr, {}, last, solution);
  } else {
    command.program = filter_->apply(q, v, wanted_, nullptr, solution);
  }
  tracked_.torque = solution.torque;
  tracked_.acceleration = solution.acceleration;
  known_before_ = false;
}

void Controller::Impl::advance_reference() noexcept {
  a_ = solution.acceleration.allFinite() ? solution.acceleration : a_;
  if (command.program == TorqueStatus::relaxed_safety || command.program == TorqueStatus::clearance_lost) {
    // Jerk goes on from what it would have allowed: a push out of what is lost ends as suddenly as it began.
    const Eigen::VectorXd& jerk = arm.robot().limits().jerk;
    for (Eigen::Index j = 0; j < a_.size(); ++j) {
      const double step = jerk[j] * settings.period;
      smooth_a_[j] += std::clamp(a_[j] - smooth_a_[j], -step, step);
    }
  } else {
    smooth_a_ = a_;
  }
  next_v_ = v_ + settings.period * a_;
  next_q_ = q_ + settings.period * next_v_;
}

}  // namespace sidestep
