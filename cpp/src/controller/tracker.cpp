#include "tracker.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "../math/cholesky.hpp"
#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double close = 0.003;  // distance to the reference within which feedback keeps the acceleration limits [rad | m]
constexpr double feedback_factor = 20.0;  // factor on accelerations elsewhere: dry friction on a light wrist takes so much [-]
constexpr double impedance_factor =
    1e3;  // factor on accelerations that an impedance asks for, of light joints and by impacts [-]
constexpr double like_reference = 0.1;   // share of the acceleration limits by which feedback may differ [-]
constexpr double of_rate = 0.5;          // share of the torque's rate that feedback asks for [-]
constexpr double free_share = 0.2;       // share of the largest error from which the arm draws the reference to itself [-]
constexpr double prismatic_share = 0.2;  // the same of prismatic joints, as a share of that [m/rad]
constexpr double rate_rounding = 1e-9;   // relative excess of a torque's largest change that is rounding of the program [-]
constexpr double most_per_period = 0.2;  // feedback's frequency × period, at most: a slow rate holds its torques for long [-]
constexpr double softer = 2.0;           // by which feedback's frequency is lower where many steps are missing [-]
// Time constant of the filter of the way back of a velocity stream: noise of the position must not reach its jerk [s].
constexpr double drift_filter = 0.05;

}  // namespace

Tracker::Tracker(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings, bool torque)
    : limits_(robot.limits()),
      joints_(joints),
      settings_(settings),
      torque_(torque),
      drives_track_(sidestep::drives_track(settings)),
      program_(within_margins(robot, settings, 1.0), settings, torque),
      solution_(robot.num_coordinates(), settings.safety.max_rows),
      feedback_(Eigen::VectorXd::Zero(robot.num_coordinates())),
      drift_(feedback_),
      mass_cholesky_(Eigen::MatrixXd::Zero(feedback_.size(), feedback_.size())) {
  if (settings.tracking.stiffness > 0.0 && !torque) {
    throw std::invalid_argument("controller: tracking.stiffness is " + std::to_string(settings.tracking.stiffness) +
                                ", but arm '" + robot.name() + "' is not moved by torque, allowed: 0");
  }
  if (is_impedance() && feedback_.size() > most_of_impedance) {
    throw std::invalid_argument("controller: tracking.stiffness is " + std::to_string(settings.tracking.stiffness) +
                                " for an arm of " + std::to_string(feedback_.size()) + " joints, allowed: 0, or at most " +
                                std::to_string(most_of_impedance) + " joints");
  }
}

double Tracker::largest_frequency(const Tick& tick) const noexcept {
  const double soft = is_impedance() ? 1.0 : 1.0 + (softer - 1.0) * tick.missing();  // a stiffness is kept
  return std::min(settings_.tracking.frequency, most_per_period / tick.period) / soft;
}

void Tracker::write_coupling(const Reference& reference, const Eigen::VectorXd& arm_q, const Tick& tick,
                             Eigen::VectorXd& coupling) const noexcept {
  coupling.setZero();
  if (drives_track_) {
    return;
  }
  // What the arm cannot follow is not run away from.
  const double w = largest_frequency(tick);
  for (Eigen::Index j = 0; j < arm_q.size(); ++j) {
    const double error = arm_q[j] - reference.q[j], share = is_impedance() ? 1.0 : free_share;
    const double free = share * settings_.tracking.largest_error * (joints_.slides(j) ? prismatic_share : 1.0);
    coupling[j] = w * w * (error - std::clamp(error, -free, free));
  }
}

bool Tracker::yield(const Eigen::VectorXd& arm_q, const Eigen::MatrixXd& mass, const Eigen::VectorXd& torque, const Tick& tick,
                    Reference& reference) const noexcept {
  const double w = largest_frequency(tick);
  // By the least change of each joint's torque ω² (M e)_j that is too large, one after the other.
  bool moved = false;
  for (Eigen::Index j = 0; j < arm_q.size(); ++j) {
    const double most = torque[j] / (w * w), pushes = mass.col(j).dot(reference.q - arm_q);
    if (std::abs(pushes) > most) {
      const double share = (pushes - std::copysign(most, pushes)) / mass.col(j).squaredNorm();
      for (Eigen::Index k = 0; k < arm_q.size(); ++k) {  // beyond a position limit never farther than it is
        const double q = reference.q[k], margin = settings_.position_margin;
        reference.q[k] =
            std::clamp(q - share * mass(k, j), std::min(q, limits_.lower[k] + margin), std::max(q, limits_.upper[k] - margin));
      }
      moved = true;
    }
  }
  return moved;
}

double Tracker::feedback_frequency(const Reference& reference, const Arm& arm, const Tick& tick) const noexcept {
  // Under a feedback that asks for more, motors that change their torque slowly would shake: ω³ |M e| and ω² |M de/dt| keep a
  // share of the rate.
  const double lead = tick.lead();
  double w = largest_frequency(tick);
  const double share = of_rate * std::min(1.0, tick.torque_period() / tick.period);
  if (torque_) {
    const Eigen::VectorXd& rate = limits_.effort_rate;
    const Eigen::MatrixXd& mass = arm.dynamics.mass();
    for (Eigen::Index j = 0; j < arm.q.size(); ++j) {
      double error = 0.0, change = 0.0;
      for (Eigen::Index k = 0; k < arm.q.size(); ++k) {
        error += mass(j, k) * (reference.q[k] - lead * reference.v[k] - arm.q[k]);
        change += mass(j, k) * (reference.v[k] - arm.v[k]);
      }
      w = std::min({w, std::cbrt(share * rate[j] / std::abs(error)), std::sqrt(share * rate[j] / std::abs(change))});
    }
  }
  return w;
}

ProgramStatus Tracker::track(const Reference& reference, const Arm& arm, double tracking_error, ProgramStatus decided,
                             const Tick& tick) noexcept {
  if (is_impedance()) {
    write_impedance(reference, arm, tick);
  } else {
    const double w = feedback_frequency(reference, arm, tick);
    feedback_ = reference.a + w * w * (reference.q - tick.lead() * reference.v - arm.q) +
                2.0 * settings_.tracking.damping * w * (reference.v - arm.v);
  }
  // The reference's acceleration meets the clearances of the arm too, as far as possible. They are asked again where feedback wants
  // something else, for no more than that acceleration gives them; and where one is lost, which the torque's rate gives way to.
  const bool as_reference =
      decided != ProgramStatus::clearance_lost &&
      ((feedback_ - reference.a).cwiseAbs().array() < like_reference * limits_.acceleration.array()).all();
  const Clearances* const clearances = as_reference ? nullptr : &arm.clearances;
  LastCommand last{&arm.last.acceleration};
  if (torque_) {
    const double factor = is_impedance() ? impedance_factor : tracking_error < close ? 1.0 : feedback_factor;
    last = near_last(arm.last.acceleration, arm.last.has_torque ? &arm.last.torque : nullptr, arm.dynamics, factor, false);
  }
  last.decided = &reference.a;
  last.yields = is_impedance();
  const ProgramStatus status =
      program_.solve(arm.q, arm.v, feedback_, arm.dynamics, clearances, {}, last, tick, solution_, arm.speed);
  return status > ProgramStatus::limited ? std::max(decided, status) : decided;
}

void Tracker::write_impedance(const Reference& reference, const Arm& arm, const Tick& tick) noexcept {
  // M a_r + K e + D de/dt + h is sent, e = q_r − q, with the h of the model: limits and clearances know of the disturbance d, which is
  // in the bias by now, the impedance does not make up for it. With M = L Lᵀ and L⁻¹ K L⁻ᵀ = U Λ Uᵀ the damping of all modes is ζ if
  // D = 2ζ L U √Λ Uᵀ Lᵀ.
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_of_impedance, 1>;
  feedback_ = reference.a;
  if (!cholesky(arm.dynamics.mass(), mass_cholesky_)) {
    return;
  }
  const Eigen::Index n = arm.q.size();
  const auto& observer = arm.dynamics.observer();
  Vector K(n), force(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double scale = joints_.slides(j) ? 1.0 / prismatic_share : 1.0;
    K[j] = scale * settings_.tracking.stiffness * limits_.effort[j];
    force[j] =
        K[j] * (reference.q[j] - tick.lead() * reference.v[j] - arm.q[j]) + (observer ? observer->disturbance()[j] : 0.0);
  }
  const Small L = mass_cholesky_;
  const auto lower = L.triangularView<Eigen::Lower>();
  Small B = K.cwiseSqrt().asDiagonal();
  lower.solveInPlace(B);
  modes_.compute(B.lazyProduct(B.transpose()));
  Vector rate = reference.v - arm.v;
  rate = lower.transpose() * rate;
  const Vector modal = modes_.eigenvalues().cwiseMax(0.0).cwiseSqrt().cwiseProduct(modes_.eigenvectors().transpose() * rate);
  lower.solveInPlace(force);
  force += 2.0 * settings_.tracking.damping * (modes_.eigenvectors() * modal);
  lower.transpose().solveInPlace(force);
  feedback_ += force;
}

bool Tracker::keep_torque_rate(const LastOutput& last, const ArmDynamics& dynamics, const Tick& tick,
                               Eigen::VectorXd& torque) noexcept {
  if (!last.has_torque) {
    return false;
  }
  bool kept = true;
  feedback_.setZero();
  for (Eigen::Index j = 0; j < torque.size(); ++j) {
    const double step = limits_.effort_rate[j] * tick.torque_period(), change = torque[j] - last.torque[j];
    if (std::abs(change) > step * (1.0 + rate_rounding)) {
      kept = false;
      feedback_[j] = std::copysign(step, change) - change;
      torque[j] = last.torque[j] + std::copysign(step, change);
    }
  }
  if (!kept && cholesky(dynamics.mass(), mass_cholesky_)) {
    solve_in_place(mass_cholesky_, feedback_);
    solution_.acceleration += feedback_;
  }
  return !kept;
}

void Tracker::write_velocity(const Reference& reference, const Eigen::VectorXd& arm_q, bool known, const Tick& tick,
                             Eigen::VectorXd& velocity) noexcept {
  const double filter = std::min(1.0, tick.period / drift_filter);
  for (Eigen::Index j = 0; j < arm_q.size(); ++j) {
    const double last = reference.v[j] + drift_[j], step = limits_.acceleration[j] * tick.period;
    const double most = std::max(limits_.velocity[j], std::abs(reference.next_v[j]));
    const double drift = known ? settings_.tracking.drift_gain * (reference.q[j] - arm_q[j]) : 0.0;
    const double wanted = reference.next_v[j] + drift_[j] + filter * (drift - drift_[j]);
    velocity[j] = std::clamp(std::clamp(wanted, last - step, last + step), -most, most);
  }
  drift_ = velocity - reference.next_v;
}

void Tracker::go_on_from(const Tracker& before) noexcept {
  solution_ = before.solution_;
  drift_ = before.drift_;
}

}  // namespace sidestep
