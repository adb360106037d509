// Whether a measured state can be the arm's, and when the motion begins anew where the arm is.
#include "measured_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace sidestep {
namespace {

constexpr int samples_to_begin_anew = 5;  // samples in a row that disagree with the reference: fewer are faults of measurement
constexpr double longest_repetition = 0.1;  // time for which the same sample again is an old one [s]
// Error of position between two samples beside what velocities explain: two to ten times an encoder's noise [rad].
constexpr double measuring_error = 0.01;
constexpr double prismatic_error = 0.2;  // the same of prismatic joints, as a share of that [m/rad]
constexpr double speed_excess = 2.0;   // speed over the velocity limits: arm and reference may move in opposite directions [-]
constexpr double most_lag = 0.1;       // lag at the velocity limit that an arm may be away from its command [s]
constexpr double largest_speed = 1e3;  // speed of joints whose velocity has no limit, to compare their errors [rad/s | m/s]
constexpr double moved_for = 1.0;      // time for which `explain` says that the arm was moved [s]
constexpr double velocity_leap = 0.1;  // share of the velocity limit by which no motor changes a velocity in a period [-]
constexpr double least_velocity_leap = 0.1;  // the same of slow joints: velocities are noisy [rad/s]
constexpr double rest_jitter = 0.1;          // velocity of an arm that may be measured at the same place again [rad/s]
constexpr double same_change = 0.05;         // change of velocity that the same numbers again do not show [rad/s]
constexpr double still = 0.005;              // distance between the samples of an arm that rests [rad]
constexpr double rest_to_begin_anew = 0.5;   // time of rest away from the command [s]

}  // namespace

MeasurementMemory::MeasurementMemory(Eigen::Index nv)
    : q(Eigen::VectorXd::Zero(nv)),
      v(q),
      last_q(Eigen::VectorXd::Constant(nv, std::numeric_limits<double>::quiet_NaN())),
      last_v(q),
      turns(q),
      sample{q, q, q, q, q, q},
      predicted_q(q),
      predicted_v(q) {
  away.anchor = q;
}

MeasuredState::MeasuredState(const Robot& robot, const JointKinds& joints, const Plausibility& plausible,
                             const ControllerSettings& settings, bool drives_track)
    : MeasurementMemory(robot.num_coordinates()),
      robot_(robot),
      joints_(joints),
      plausible_(plausible),
      settings_(settings),
      drives_track_(drives_track) {}

bool MeasuredState::take(ConstVectorRef sample_q, ConstVectorRef sample_v) noexcept {
  impossible = {};
  if (sample_q.size() != q.size() || sample_v.size() != q.size() || !sample_q.allFinite() || !sample_v.allFinite()) {
    return false;
  }
  if (!plausible_before) {  // a state in another unit must not move the arm in the first steps
    impossible = plausible_.impossible(sample_q, sample_v);
    if (impossible.joint >= 0) {
      return false;
    }
    plausible_before = true;
  }
  q = sample_q;
  v = sample_v;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    if (!joints_.is_unlimited(j)) {
      continue;
    }
    // An encoder that wraps at a turn: no velocity explains a jump of more than half of one.
    q[j] += turns[j];
    if (known_before) {
      const double turn = 2.0 * std::numbers::pi * std::round((last_q[j] - q[j]) / (2.0 * std::numbers::pi));
      turns[j] += turn;
      q[j] += turn;
    }
  }
  return true;
}

void MeasuredState::judge(const Eigen::VectorXd& commanded_q, const Eigen::VectorXd& last_acceleration,
                          const Tick& tick) noexcept {
  const bool was_unusable = std::exchange(sample.unusable, false);
  sample.q = q;
  sample.v = v;
  agrees = true;
  is_bridged = sample.takes_velocity = false;
  const bool first = begins();
  Comparison comparison;
  if (!first) {
    predicted_v = last_v + tick.moved * last_acceleration;
    predicted_q = last_q + tick.moved * predicted_v;
    comparison = compare_sample(commanded_q, tick);
  }
  agrees = comparison.is_near && comparison.is_possible;
  if (agrees) {
    sample.disagreeing = 0;
  } else {
    // Without a torque that depends on it the arm can wait until the samples agree with each other.
    sample.disagreeing = drives_track_ && !comparison.is_steady ? 1 : sample.disagreeing + 1;
    const bool anew = sample.disagreeing >= samples_to_begin_anew || tick.pauses || was_unusable;
    if (anew && plausible_.impossible(sample.q, sample.v).joint >= 0) {  // in another unit: not the arm, from the next on
      plausible_before = false;
      is_bridged = true;
    } else if (anew) {
      sample.disagreeing = 0;
      agrees = begins_anew = true;
      away.moved_until = tick.time + moved_for;
    } else {
      is_bridged = !comparison.is_possible;
    }
  }
  if (drives_track_ && agrees && !first && !begins_anew && rests_elsewhere(tick.time)) {
    begins_anew = true;
    away.moved_until = tick.time + moved_for;
  }
  if (!first && !begins_anew && !drives_track_ && !is_bridged) {
    check_repetition(tick);
    if (!is_bridged) {
      check_velocity(tick);
    }
  }
  sample.last_q = sample.q;
  sample.last_v = sample.v;
  if (is_bridged) {
    q = predicted_q;
    v = predicted_v;
    turns = sample.turns;
  } else {
    sample.turns = turns;
  }
}

MeasuredState::Comparison MeasuredState::compare_sample(const Eigen::VectorXd& commanded_q, const Tick& tick) const noexcept {
  // An arm whose drives track the reference comes nearer to it in a step that is late; one that is moved by torque moves on.
  const double T = drives_track_ ? tick.expected : tick.moved;
  const double most = drives_track_ ? settings_.tracking.servo_lag : settings_.tracking.largest_error;
  const double time = T * (1 + sample.disagreeing);
  Comparison found;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double scale = error_scale(j), rounding = scale * measuring_error;
    const double speed = speed_excess * robot_.limits().velocity[j];
    const double error = std::abs(commanded_q[j] - sample.q[j]), expected = std::abs(commanded_q[j] - predicted_q[j]);
    found.is_near = found.is_near && error <= scale * most;
    found.is_possible = found.is_possible && error <= expected + speed * time + rounding;
    found.is_steady = found.is_steady && std::abs(sample.q[j] - sample.last_q[j]) <= speed * T + rounding;
  }
  return found;
}

bool MeasuredState::rests_elsewhere(double time) noexcept {
  // Led away slowly, or kept from moving: no sample alone is impossible, yet drives that are let go would leap.
  bool moves = !away.is_far;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double scale = error_scale(j);
    moves = moves || std::abs(sample.q[j] - away.anchor[j]) > scale * still;
  }
  if (moves) {
    away.anchor = sample.q;
    away.since = time;
  }
  return time - away.since >= rest_to_begin_anew;
}

double MeasuredState::error_scale(Eigen::Index j) const noexcept { return joints_.slides(j) ? prismatic_error : 1.0; }

void MeasuredState::check_repetition(const Tick& tick) noexcept {
  // The same numbers again although the arm moves: they are old.
  bool same = sample.q == sample.last_q && sample.v == sample.last_v, moves = false;
  if (!same || sample.v.isZero(0.0)) {  // an arm that is held does not move, whatever is commanded
    sample.change.setZero();
  } else {
    sample.change += predicted_v - last_v;
  }
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double scale = error_scale(j);
    moves = moves || std::abs(sample.v[j]) > scale * rest_jitter || std::abs(sample.change[j]) > scale * same_change;
  }
  same = same && moves;
  sample.repeated = same ? sample.repeated + 1 : 0;
  if (!same || sample.repeated * tick.expected > longest_repetition) {
    return;
  }
  is_bridged = true;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double scale = error_scale(j);
    agrees = agrees && std::abs(predicted_q[j] - sample.q[j]) <= scale * measuring_error;
  }
}

void MeasuredState::check_velocity(const Tick& tick) noexcept {
  // A velocity that leaps where the position does not is a fault of its measurement, unless it stays so.
  const Eigen::VectorXd& speed = robot_.limits().velocity;
  const bool stays = sample.leaps + 1 >= samples_to_begin_anew;
  bool any = false;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double moved = (sample.q[j] - sample.last_q[j]) / tick.moved;
    const double noise = error_scale(j) * least_velocity_leap;
    const bool leaps = std::abs(sample.v[j] - predicted_v[j]) > std::max(velocity_leap * speed[j], noise) &&
                       std::abs(moved - sample.v[j]) > std::abs(moved - predicted_v[j]);
    any = any || leaps;
    if (leaps && !stays) {
      v[j] = predicted_v[j];
    }
  }
  sample.takes_velocity = any && stays;
  sample.leaps = any && !stays ? sample.leaps + 1 : 0;
}

void MeasuredState::filter_velocity(const Eigen::VectorXd& last_acceleration, const Tick& tick) noexcept {
  const double share = sample.takes_velocity ? 1.0 : std::min(1.0, tick.moved / settings_.tracking.velocity_filter);
  predicted_v = last_v + tick.moved * last_acceleration;
  v = predicted_v + share * (v - predicted_v);
}

void MeasuredState::compare(const Eigen::VectorXd& commanded_q) noexcept {
  const Eigen::VectorXd& speed = robot_.limits().velocity;
  away.is_far = !agrees;
  double largest = 0.0;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double share = std::abs(commanded_q[j] - sample.q[j]) / (most_lag * std::min(speed[j], largest_speed));
    if (share > largest) {
      largest = share;
      away.farthest = j;
    }
    away.is_far = away.is_far || std::abs(commanded_q[j] - sample.q[j]) > most_lag * speed[j];
  }
}

void MeasuredState::end_step() noexcept {
  known_before = true;
  last_q = q;
  last_v = v;
}

void MeasuredState::end_without_state(bool forgets) noexcept {
  sample.unusable = true;
  known_before = known_before && !forgets;
}

std::string MeasuredState::explain(const Eigen::VectorXd& commanded_q, double time) const {
  if (away.is_far) {
    const Eigen::Index joint = away.farthest;
    char error[64];
    std::snprintf(error, sizeof error, joints_.slides(joint) ? "%.3f m" : "%.2f rad",
                  std::abs(commanded_q[joint] - sample.q[joint]));
    return "the arm is not where it was commanded: joint '" + robot_.coordinate_names()[static_cast<std::size_t>(joint)] +
           "' is " + error + " off; " +
           (agrees ? "check its drives, or slow the motion down; "
                   : "stopping until the measured position agrees with the command, or five in a row agree with each other");
  }
  return time < away.moved_until ? "the arm was moved by something else: continuing from where it is; " : "";
}

}  // namespace sidestep
