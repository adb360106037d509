#include "touch_judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sidestep {
namespace {

constexpr double touch_filter = 0.01;  // time constant of all that is felt [s]: noise of velocities, and what a delay shows
constexpr double way = 0.05;           // way on which what explains the torque is learnt [rad]
constexpr double prismatic_way = 0.2;  // the same of prismatic joints, as a share of that [m/rad]
constexpr double seeding = 0.05;       // time from the begin in which what is felt is load: five filters long [s]
constexpr double turning = 0.02;       // speed at which dry friction is 0.7 of the whole [rad/s | m/s]
constexpr double of_moved = 0.2;       // share of M v̇ that a payload or rotors explain [-]
constexpr double of_sample = 2.5;      // what one sample shows, at most, in effort limits: alone it is no touch [-]
constexpr double most_slip = 0.005;    // Way that the velocity does not explain: five times an encoder's noise [rad].
constexpr double soft_share = 0.5;     // share of the allowed torque by which an arm that was touched resists [-]
constexpr int after_late = 5;          // samples that do not count from one on that came late: the arm is led back in them
constexpr int least_samples = 3;       // samples of a touch, at least: loops of long periods

}  // namespace

TouchMemory::TouchMemory(Eigen::Index nv)
    : last_q(Eigen::VectorXd::Zero(nv)),
      last_v(last_q),
      felt(last_q),
      moved(last_q),
      sign(last_q),
      load(last_q),
      friction(last_q) {}

TouchJudge::TouchJudge(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings, bool judges)
    : TouchMemory(robot.num_coordinates()),
      robot_(robot),
      joints_(joints),
      judges_(judges && std::isfinite(settings.contact.share)),
      least_lasting_(settings.contact.time),
      share_(settings.contact.share * robot.limits().effort),
      most_(of_sample * robot.limits().effort),
      resistance_(soft_share * share_),
      acceleration_(last_q),
      rest_(last_q) {}

bool TouchJudge::judge(const Sample& now, const Acted& acted) noexcept {
  if (!judges_ || touched) {
    gap = true;
    return false;
  }
  if (now.begins) {
    seeds = seeding;
    felt.setZero();
    moved.setZero();
    sign.setZero();
    load.setZero();
    friction.setZero();
  }
  const bool repeats = now.q == last_q && now.v == last_v && !now.v.isZero(0.0);  // an old sample, however slow the arm is
  unsteady = now.late ? after_late : std::max(0, unsteady - 1);
  const bool counts = !now.begins && !now.bridged && !repeats && !gap && unsteady == 0 && is_steady(now);
  gap = now.bridged || repeats;
  acceleration_ = (now.v - last_v) / now.elapsed;
  last_q = now.q;
  last_v = now.v;
  if (!counts) {
    lasts = 0;
    lasted = 0.0;
    return false;
  }
  const double filter = std::min(1.0, now.elapsed / touch_filter);
  double largest = 1.0;
  for (Eigen::Index j = 0; j < felt.size(); ++j) {
    const double inertia = acted.mass.row(j).dot(acceleration_), lacks = inertia + acted.bias[j] - acted.torque[j];
    const double v = now.v[j];
    if (std::isfinite(lacks)) {
      felt[j] += filter * std::clamp(lacks - felt[j], -most_[j], most_[j]);
      moved[j] += filter * (inertia - moved[j]);
    }
    sign[j] += filter * (v / std::sqrt(v * v + turning * turning) - sign[j]);
    rest_[j] = felt[j] - load[j] - friction[j] * sign[j];
    const double most = share_[j] + std::abs(friction[j]) + of_moved * std::abs(moved[j]);
    if (std::abs(rest_[j]) > largest * most) {
      largest = std::abs(rest_[j]) / most;
      joint = j;
      torque = rest_[j];
      allowed = most;
    }
  }
  if (largest > 1.0 && !(seeds > 0.5 * now.elapsed)) {  // what exceeds what is allowed is not learnt
    lasted += now.elapsed;
    touched = ++lasts >= least_samples && lasted > least_lasting_ - 0.5 * now.elapsed;
    return touched;
  }
  lasts = 0;
  lasted = 0.0;
  learn(now, acted.mass);
  return false;
}

bool TouchJudge::is_steady(const Sample& now) const noexcept {
  for (Eigen::Index j = 0; j < last_q.size(); ++j) {
    const double slip = std::abs(now.q[j] - last_q[j] - now.elapsed * now.v[j]);
    if (!(slip <= (joints_.slides(j) ? prismatic_way : 1.0) * most_slip)) {
      return false;
    }
  }
  return true;
}

void TouchJudge::learn(const Sample& now, const Eigen::MatrixXd& mass) noexcept {
  const Eigen::VectorXd& v = now.v;
  if (seeds > 0.5 * now.elapsed) {
    seeds -= now.elapsed;
    load += rest_;
    return;
  }
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    // Another joint moves this one's load by as much as it moves its inertia: a wrist that turns says little of the shoulder.
    double speed = 0.0;
    for (Eigen::Index k = 0; k < v.size(); ++k) {
      const double moves = std::min(mass(j, j), std::abs(mass(j, k))) * std::abs(v[k]);
      speed = std::max(speed, joints_.slides(k) ? moves / prismatic_way : moves);
    }
    const double share = std::min(1.0, now.elapsed * speed / (way * mass(j, j)));
    const double change = share / (1.0 + sign[j] * sign[j]) * rest_[j];
    if (!std::isfinite(change)) {
      continue;
    }
    load[j] += change;
    friction[j] += change * sign[j];
  }
}

void TouchJudge::go_on_from(const TouchJudge& before) noexcept {
  static_cast<TouchMemory&>(*this) = before;
  seeds = seeding;  // another body weighs something else
}

std::string TouchJudge::explain() const {
  const char* const unit = joints_.slides(joint) ? "N" : "Nm";
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "%.1f %s that nothing explains (allowed: %.1f)", std::abs(torque), unit, allowed);
  return "waiting: joint '" + robot_.coordinate_names()[static_cast<std::size_t>(joint)] + "' feels " + numbers +
         ": the arm touched something, or a load is not told; call restart() to go on";
}

}  // namespace sidestep
