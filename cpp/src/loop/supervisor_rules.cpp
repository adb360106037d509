#include "sidestep/loop/supervisor_rules.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "short_number.hpp"

namespace sidestep {

template <>
const std::vector<Field<SupervisorSettings>>& fields() {
  using S = SupervisorSettings;
  constexpr double inf = std::numeric_limits<double>::infinity();
  static const std::vector<Field<S>> all{
      {"tolerance", &S::tolerance, "-", 0.0, 10.0,
       "share by which velocities, torques and torque rates may exceed their limits: more bears more noise, and denies later"},
      {"position_tolerance", &S::position_tolerance, "rad", 0.0, 1.0,
       "distance by which positions may be outside their limits"},
      {"tracking_tolerance", &S::tracking_tolerance, "rad", 0.001, inf,
       "largest distance of a commanded position from the measured one: a jump is denied"},
      {"state_age", &S::state_age, "s", 0.001, inf, "age above which a measured state is too old"},
      {"blind_time", &S::blind_time, "s", 0.001, inf,
       "time without a new state after which no command is approved any more: the loop brakes the arm without one for less"},
      {"command_age", &S::command_age, "s", 0.001, inf, "time without a report of the loop after which approval ends"},
      {"approval_age", &S::approval_age, "s", 0.001, inf,
       "age above which the supervisor's last approval does not count: longer bears a busier machine, and notices its death later"},
      {"stale_time", &S::stale_time, "s", 0.01, inf, "time after which an arm must be at rest whose obstacles are too old"},
      {"rest_speed", &S::rest_speed, "rad/s", 0.001, inf, "joint speed that counts as rest then"},
  };
  return all;
}

void SupervisorSettings::validate() const { check_fields("supervisor: ", *this); }

SupervisorRules::SupervisorRules(const JointLimits& limits, double period, const SupervisorSettings& settings)
    : limits_(limits), period_(period), settings_((settings.validate(), settings)) {
  if (limits.lower.size() > CycleReport::most_joints) {
    throw std::invalid_argument("supervisor: the arm has " + std::to_string(limits.lower.size()) + " joints, at most " +
                                std::to_string(CycleReport::most_joints) + " are allowed");
  }
  if (limits_.effort_rate.size() == 0) {
    limits_.effort_rate = Eigen::VectorXd::Constant(limits.lower.size(), std::numeric_limits<double>::infinity());
  }
  reset();
}

void SupervisorRules::reset() noexcept {
  verdict_ = {};
  verdict_.denial = Denial::none;
  last_ = {};
  stale_since_ = blind_since_ = -1.0;
}

const Verdict& SupervisorRules::wait(double now) noexcept {
  verdict_.now = now;
  if (verdict_.approves() && last_.cycle != 0 && now - last_.now > settings_.command_age) {
    verdict_.denial = Denial::silent_loop;
    verdict_.value = now - last_.now;
    verdict_.limit = settings_.command_age;
  }
  return verdict_;
}

const Verdict& SupervisorRules::judge(const CycleReport& report) noexcept {
  if (report.is_over) {
    last_ = {};
    stale_since_ = blind_since_ = -1.0;
    return wait(report.now);
  }
  blind_since_ = !report.is_blind ? -1.0 : blind_since_ < 0.0 ? report.now : blind_since_;
  if (verdict_.approves()) {
    verdict_ = first_fault(report);
    stale_since_ = !report.stale ? -1.0 : stale_since_ < 0.0 ? report.now : stale_since_;
    const double speed = num_joints() == 0 ? 0.0
                                           : *std::max_element(report.v.begin(), report.v.begin() + num_joints(),
                                                               [](double a, double b) { return std::abs(a) < std::abs(b); });
    if (verdict_.approves() && report.stale && report.now - stale_since_ > settings_.stale_time &&
        std::abs(speed) > settings_.rest_speed) {
      verdict_.denial = Denial::moves_blindly;
      verdict_.value = std::abs(speed);
      verdict_.limit = settings_.rest_speed;
    }
  }
  verdict_.cycle = report.cycle;
  verdict_.now = report.now;
  last_ = report;
  return verdict_;
}

Verdict SupervisorRules::first_fault(const CycleReport& report) const noexcept {
  Verdict found;
  found.denial = Denial::none;
  const double age = report.is_blind ? report.now - blind_since_ : report.state_age;
  const double oldest = report.is_blind ? settings_.blind_time : settings_.state_age;
  if (age > oldest) {
    found.denial = Denial::old_state;
    found.value = age;
    found.limit = oldest;
    return found;
  }
  for (int j = 0; j < num_joints(); ++j) {
    if (is_outside(report, j, found)) {
      found.joint = j;
      return found;
    }
  }
  return found;
}

bool SupervisorRules::is_outside(const CycleReport& report, int joint, Verdict& found) const noexcept {
  const auto k = static_cast<std::size_t>(joint);
  const auto denied = [&](Denial why, double value, double limit) {
    found.denial = why;
    found.value = value;
    found.limit = limit;
    return true;
  };
  const double q = report.q[k], v = report.v[k], position = report.position[k], velocity = report.velocity[k];
  for (const double number :
       {q, v, velocity, report.writes_position ? position : 0.0, report.writes_torque ? report.torque[k] : 0.0}) {
    if (!std::isfinite(number)) {
      return denied(Denial::not_finite, number, 0.0);
    }
  }
  const double beyond = settings_.position_tolerance, most = 1.0 + settings_.tolerance;
  for (const double at : {q, report.writes_position ? position : q}) {
    if (at < limits_.lower[joint] - beyond || at > limits_.upper[joint] + beyond) {
      return denied(Denial::position, at, at < limits_.lower[joint] ? limits_.lower[joint] : limits_.upper[joint]);
    }
  }
  for (const double speed : {v, velocity}) {
    if (std::abs(speed) > most * limits_.velocity[joint]) {
      return denied(Denial::velocity, speed, limits_.velocity[joint]);
    }
  }
  const double from = report.is_blind && last_.writes_position ? last_.position[k] : q;  // q stands still while the arm brakes
  if (report.writes_position && std::abs(position - from) > settings_.tracking_tolerance) {
    return denied(Denial::tracking, position - from, settings_.tracking_tolerance);
  }
  if (!report.writes_torque) {
    return false;
  }
  if (std::abs(report.torque[k]) > most * limits_.effort[joint]) {
    return denied(Denial::torque, report.torque[k], limits_.effort[joint]);
  }
  const double rate = (report.torque[k] - last_.torque[k]) / std::max(period_, report.now - last_.now);
  if (last_.cycle != 0 && last_.writes_torque && std::abs(rate) > most * limits_.effort_rate[joint]) {
    return denied(Denial::torque_rate, rate, limits_.effort_rate[joint]);
  }
  return false;
}

std::string Verdict::words(const std::vector<std::string>& joints) const {
  const std::string of = joint < 0 ? std::string()
                         : static_cast<std::size_t>(joint) < joints.size()
                             ? "joint '" + joints[static_cast<std::size_t>(joint)] + "': "
                             : "joint " + std::to_string(joint) + ": ";
  const std::string figures = " " + short_number(value) + ", allowed " + short_number(limit);
  switch (denial) {
    case Denial::none: return "approved";
    case Denial::unknown: return "nothing was judged yet";
    case Denial::not_finite: return of + "a number is not finite";
    case Denial::position: return of + "position" + figures;
    case Denial::velocity: return of + "velocity" + figures;
    case Denial::torque: return of + "torque" + figures;
    case Denial::torque_rate: return of + "torque rate" + figures;
    case Denial::tracking: return of + "commanded position away from the arm by" + figures;
    case Denial::old_state: return "age of the state [s]" + figures;
    case Denial::silent_loop: return "time without a report of the loop [s]" + figures;
    case Denial::moves_blindly: return "obstacles are too old, but the arm moves at" + figures;
    case Denial::silent_supervisor: break;
  }
  return "the supervisor has not answered for [s]" + figures;
}

}  // namespace sidestep
