// Whether a measured state can be the arm's, and how the controller begins anew where the arm is.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "../math/cholesky.hpp"
#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr int samples_to_begin_anew = 5;  // in a row that disagree with the reference: fewer are faults of the measurement
constexpr double longest_gap = 0.1;       // [s] between two steps after which one sample is enough: no loop is so late
constexpr double longest_periods = 5.0;   // the same, of loops of long periods [periods]
constexpr double measuring_error =
    0.01;  // [rad] between two samples beside what velocities explain: two to ten times an encoder's noise
constexpr double sliding_error = 0.2;        // the same of joints that slide, as a share of that [m/rad]
constexpr double speed_excess = 2.0;         // of the velocity limits: arm and reference may move in opposite directions [-]
constexpr double most_lag = 0.1;             // [s] at the velocity limit that an arm may be away from its command
constexpr double largest_speed = 1e3;        // [rad/s | m/s] of joints whose velocity has no limit, to compare their errors
constexpr double moved_for = 1.0;            // [s] for which `explain` says that the arm was moved
constexpr double velocity_leap = 0.1;        // of the velocity limit, by which no motor changes a velocity in a period [-]
constexpr double least_velocity_leap = 0.1;  // [rad/s] the same, of slow joints: velocities are noisy
constexpr double rest_jitter = 0.1;          // [rad/s] of an arm that may be measured at the same place again
constexpr double still = 0.005;              // [rad] between the samples of an arm that rests
constexpr double rest_to_begin_anew = 0.5;   // [s] of it, away from the command
constexpr double rate_rounding = 1e-9;       // of a torque's largest change, relative: rounding of the program

}  // namespace

void Controller::Impl::judge_sample() noexcept {
  Measurement& m = measurement_;
  const auto now = std::chrono::steady_clock::now();
  const double elapsed = m.elapsed =
      std::isnan(m.replayed_elapsed) ? std::chrono::duration<double>(now - m.stepped_at).count() : m.replayed_elapsed;
  const double longest = std::max(longest_gap, longest_periods * settings.period);
  const bool paused = elapsed > longest, was_unusable = std::exchange(m.unusable, false);
  m.q = arm_q_;
  m.v = arm_v_;
  m.agrees = true;
  m.is_bridged = m.takes_velocity = false;
  const bool begins = !known_before_ || begins_anew_;
  bool is_near = true, is_possible = true, is_steady = true;
  if (!begins) {
    expected_v_ = last_arm_v_ + settings.period * last_acceleration_;
    m.predicted = last_arm_q_ + settings.period * expected_v_;
    compare_sample(elapsed, is_near, is_possible, is_steady);
  }
  m.agrees = is_near && is_possible;
  if (m.agrees) {
    m.disagreeing = 0;
  } else {
    // Without a torque that depends on it the arm can wait until the samples agree with each other.
    m.disagreeing = drives_track_ && !is_steady ? 1 : m.disagreeing + 1;
    const bool anew = m.disagreeing >= samples_to_begin_anew || paused || was_unusable;
    if (anew && plausible_.impossible(m.q, m.v).joint >= 0) {  // in another unit: not the arm, from the next sample on
      plausible_before_ = false;
      m.is_bridged = true;
    } else if (anew) {
      m.disagreeing = 0;
      m.agrees = begins_anew_ = true;
      m.moved_until = time_ + moved_for;
    } else {
      m.is_bridged = !is_possible;
    }
  }
  if (drives_track_ && m.agrees && !begins && !begins_anew_ && rests_elsewhere()) {
    begins_anew_ = true;
    m.moved_until = time_ + moved_for;
  }
  if (!begins && !begins_anew_ && !drives_track_ && !m.is_bridged) {
    check_repetition();
    if (!m.is_bridged) {
      check_velocity();
    }
  }
  m.last_q = m.q;
  m.last_v = m.v;
  if (m.is_bridged) {
    arm_q_ = m.predicted;
    arm_v_ = expected_v_;
    turns_ = m.turns;
  } else {
    m.turns = turns_;
  }
}

void Controller::Impl::compare_sample(double elapsed, bool& is_near, bool& is_possible, bool& is_steady) const noexcept {
  // An arm whose drives track the reference comes nearer to it in a step that is late; one that is moved by torque moves on.
  const Measurement& m = measurement_;
  const double T = settings.period;
  const double late =
      drives_track_ || settings.synchronous ? 0.0 : std::min(elapsed, std::max(longest_gap, longest_periods * settings.period));
  const double most = drives_track_ ? settings.tracking.servo_lag : settings.tracking.largest_error;
  const double time = std::max(late, T * (1 + m.disagreeing));
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double scale = error_scale(j), rounding = scale * measuring_error;
    const double speed = speed_excess * arm.robot().limits().velocity[j];
    const double error = std::abs(next_q_[j] - m.q[j]), expected = std::abs(next_q_[j] - m.predicted[j]);
    is_near = is_near && error <= scale * most;
    is_possible = is_possible && error <= expected + speed * time + rounding;
    is_steady = is_steady && std::abs(m.q[j] - m.last_q[j]) <= speed * std::max(late, T) + rounding;
  }
}

bool Controller::Impl::rests_elsewhere() noexcept {
  // Led away slowly, or kept from moving: no sample alone is impossible, yet drives that are let go would leap.
  Measurement& m = measurement_;
  bool moves = !m.is_far;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double scale = error_scale(j);
    moves = moves || std::abs(m.q[j] - m.anchor[j]) > scale * still;
  }
  if (moves) {
    m.anchor = m.q;
    m.anchored_at = time_;
  }
  return time_ - m.anchored_at >= rest_to_begin_anew;
}

double Controller::Impl::error_scale(Eigen::Index j) const noexcept {
  return is_sliding_[static_cast<std::size_t>(j)] ? sliding_error : 1.0;
}

void Controller::Impl::check_repetition() noexcept {
  // The same numbers again although the arm moves: they are old.
  Measurement& m = measurement_;
  bool same = m.q == m.last_q && m.v == m.last_v, moves = false;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    moves = moves || std::abs(m.v[j]) > error_scale(j) * rest_jitter;
  }
  same = same && moves;
  m.repeated = same ? m.repeated + 1 : 0;
  if (!same || m.repeated * settings.period > longest_gap) {
    return;
  }
  m.is_bridged = true;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double scale = error_scale(j);
    m.agrees = m.agrees && std::abs(m.predicted[j] - m.q[j]) <= scale * measuring_error;
  }
}

void Controller::Impl::check_velocity() noexcept {
  // A velocity that leaps where the position does not is a fault of its measurement, unless it stays so.
  Measurement& m = measurement_;
  const Eigen::VectorXd& speed = arm.robot().limits().velocity;
  const bool stays = m.leaps + 1 >= samples_to_begin_anew;
  bool any = false;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double moved = (m.q[j] - m.last_q[j]) / settings.period;
    const double noise = error_scale(j) * least_velocity_leap;
    const bool leaps = std::abs(m.v[j] - expected_v_[j]) > std::max(velocity_leap * speed[j], noise) &&
                       std::abs(moved - m.v[j]) > std::abs(moved - expected_v_[j]);
    any = any || leaps;
    if (leaps && !stays) {
      arm_v_[j] = expected_v_[j];
    }
  }
  m.takes_velocity = any && stays;
  m.leaps = any && !stays ? m.leaps + 1 : 0;
}

void Controller::Impl::begin_anew() noexcept {
  begins_anew_ = false;
  feedback_ = next_q_ - arm_q_;
  begin_reference();
  if (drives_track_) {  // drives that are on the way back to the old command stop with the new one
    next_v_ = (feedback_.array() * next_v_.array() > 0.0).select(0.0, next_v_);
  }
  last_acceleration_.setZero();
  drift_.setZero();
  last_measured_v_ = arm_v_;
  has_last_wanted_v_ = has_ideal_v_ = false;
  avoiding_ = pending_ = false;
  clock_.rate = clock_.change = 0.0;  // a trajectory goes on from where its clock is
  clock_.seen = -1.0;
  // The goal stays: a posture and a path are looked for from here.
  begins_goal_ = goal_ != nullptr && !has_input();
  target_blocked_ = rests_ = false;
  num_lowered_ = -1;
  next_posture_ = next_look_ = 0.0;
}

void Controller::Impl::add_drift(bool known) noexcept {
  const JointLimits& limits = arm.robot().limits();
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double last = v_[j] + drift_[j], step = limits.acceleration[j] * settings.period;
    const double most = std::max(limits.velocity[j], std::abs(next_v_[j]));
    const double wanted = next_v_[j] + (known ? settings.tracking.drift_gain * (q_[j] - arm_q_[j]) : 0.0);
    command.velocity[j] = std::clamp(std::clamp(wanted, last - step, last + step), -most, most);
  }
  drift_ = command.velocity - next_v_;
}

void Controller::Impl::look_at_sample() noexcept {
  Measurement& m = measurement_;
  if (m.is_bridged) {  // what is reported is of the arm, as far as it is measured
    arm_workspace_.activations = workspace.activations;
    apart_ = system->embed(m.q, m.v, obstacles(), arm_workspace_) || apart_;
    command.tracking_error = (q_ - m.q).cwiseAbs().maxCoeff();
  }
  const Eigen::VectorXd& speed = arm.robot().limits().velocity;
  m.is_far = !m.agrees;
  double largest = 0.0;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double share = std::abs(next_q_[j] - m.q[j]) / (most_lag * std::min(speed[j], largest_speed));
    if (share > largest) {
      largest = share;
      m.farthest = j;
    }
    m.is_far = m.is_far || std::abs(next_q_[j] - m.q[j]) > most_lag * speed[j];
  }
}

void Controller::Impl::keep_torque_rate() noexcept {
  if (!has_last_torque_) {
    return;
  }
  const Eigen::VectorXd& rate = arm.robot().limits().effort_rate;
  bool kept = true;
  feedback_.setZero();
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double step = rate[j] * settings.period, change = command.torque[j] - last_torque_[j];
    if (std::abs(change) > step * (1.0 + rate_rounding)) {
      kept = false;
      feedback_[j] = std::copysign(step, change) - change;
      command.torque[j] = last_torque_[j] + std::copysign(step, change);
    }
  }
  if (kept) {
    return;
  }
  if (!apart_) {
    reference_torque_ = command.torque;
  }
  if (cholesky(mass_, mass_cholesky_)) {
    solve_in_place(mass_cholesky_, feedback_);
    tracked_.acceleration += feedback_;
  }
}

std::string Controller::Impl::explain_measurement() const {
  const Measurement& m = measurement_;
  if (m.is_far) {
    const auto joint = static_cast<std::size_t>(m.farthest);
    char error[64];
    std::snprintf(error, sizeof error, is_sliding_[joint] ? "%.3f m" : "%.2f rad",
                  std::abs(next_q_[m.farthest] - m.q[m.farthest]));
    return "the arm is not where it was commanded: joint '" + arm.robot().coordinate_names()[joint] + "' is " + error +
           " off; " +
           (m.agrees ? "check its drives, or slow the motion down; "
                     : "it stops until the measured position agrees with the command, or five in a row with each other");
  }
  return time_ < m.moved_until ? "the arm was moved by something else: it goes on from where it is; " : "";
}

}  // namespace sidestep
