#include "failsafe.hpp"

#include <algorithm>
#include <cmath>

#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr double jerk_of_stops = 0.95;   // of the limits
constexpr double least_floor = 0.001;    // [m] of clearance that stops keep
constexpr double below_now = 0.0002;     // [m] by which they may come nearer, where there is less
constexpr double least_look = 0.001;     // [m] of motion between two looks
constexpr double looks_of_stop = 32.0;   // where there is hardly room
constexpr double near_body = 0.03;       // [m] nearer than that a look is exact
constexpr double far_from_body = 0.1;    // [m] farther is as good: what moves is as far for as long as a stop takes
constexpr double rounded = 1e-6;         // relative
constexpr int slower_stops = 3;          // each with half the acceleration

}  // namespace

Failsafe::Failsafe(const BodyClearance& body, const JointLimits& limits, double period)
    : body_(body),
      room_(body),
      limits_(limits),
      slowed_(limits),
      period_(period),
      stop_(body.robot().num_coordinates()),
      next_stop_(stop_),
      next_q_(Eigen::VectorXd::Zero(body.robot().num_coordinates())),
      next_v_(next_q_),
      q_(next_q_),
      v_(next_q_),
      a_(next_q_),
      force_(next_q_),
      clearances_(Eigen::VectorXd::Zero(body.num_items())),
      floors_(clearances_),
      looked_at_(Eigen::MatrixXd::Zero(next_q_.size(), most_looked)),
      looked_room_(Eigen::VectorXd::Zero(most_looked)) {}

bool Failsafe::keep(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& last, const Obstacles& obstacles,
                    const StopTorque* torque, Eigen::VectorXd& a) noexcept {
  if (!known_ || low_) {
    set_floors(q, obstacles);
  }
  if (is_smooth(last, a)) {
    next_v_ = v + period_ * a;
    next_q_ = q + period_ * next_v_;
    if (plan(next_q_, next_v_, a, torque) && is_free(next_stop_, next_q_, next_v_, obstacles)) {
      std::swap(stop_, next_stop_);
      known_ = true;
      return false;
    }
  }
  known_ = known_ && is_free(stop_, q, v, obstacles);
  if (!known_) {
    return false;
  }
  stop_.acceleration(0, a_);
  if (torque != nullptr && !is_within_effort(a_, *torque)) {
    known_ = false;
    return false;
  }
  a = a_;
  stop_.advance();
  return true;
}

bool Failsafe::is_smooth(const Eigen::VectorXd& last, const Eigen::VectorXd& a) const noexcept {
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    const double rounding = rounded * (1.0 + std::abs(a[j]));
    if (!(std::abs(a[j] - last[j]) <= limits_.jerk[j] * period_ + rounding &&
          std::abs(a[j]) <= limits_.acceleration[j] + rounding)) {
      return false;
    }
  }
  return true;
}

bool Failsafe::is_within_effort(const Eigen::VectorXd& a, const StopTorque& torque) noexcept {
  force_ = torque.bias;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    force_ += a[j] * torque.mass.col(j);
  }
  return (force_.array().abs() <= limits_.effort.array()).all();
}

bool Failsafe::plan(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
                    const StopTorque* torque) noexcept {
  if (torque == nullptr) {
    return next_stop_.plan(q, v, a, limits_, period_, jerk_of_stops);
  }
  // One that is slower takes less torque.
  slowed_.acceleration = limits_.acceleration;
  for (int k = 0; k < slower_stops; ++k) {
    if (!next_stop_.plan(q, v, a, slowed_, period_, jerk_of_stops * torque->jerk_share)) {
      return false;
    }
    if (is_within_effort(next_stop_.hardest(), *torque)) {
      return true;
    }
    slowed_.acceleration *= 0.5;
  }
  return false;
}

void Failsafe::set_floors(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept {
  body_.clearances(q, obstacles, least_floor + below_now, room_, clearances_);
  low_ = false;
  for (Eigen::Index i = 0; i < floors_.size(); ++i) {
    const double now = std::min(least_floor, clearances_[i] - below_now);
    floors_[i] = known_ ? std::max(floors_[i], now) : now;
    low_ = low_ || floors_[i] < least_floor;
  }
  num_looked_ = 0;
}

double Failsafe::room_at(const Eigen::VectorXd& q, double least, const Obstacles& obstacles) noexcept {
  const Eigen::VectorXd& reach = body_.reach();
  double most = -infinity;
  for (int k = 0; k < std::min(num_looked_, most_looked); ++k) {
    double left = std::max(looked_room_[k], least);
    for (Eigen::Index j = 0; j < q.size() && left > most; ++j) {
      left -= reach[j] * std::abs(q[j] - looked_at_(j, k));
    }
    most = std::max(most, left);
  }
  if (most > 0.0) {
    return most;
  }
  const double room = body_.room(q, obstacles, floors_, near_body, far_from_body, room_);
  if (room >= 0.0) {
    const int at = num_looked_ % most_looked;
    looked_at_.col(at) = q;
    looked_room_[at] = room;
    num_looked_ = num_looked_ + 1 < 2 * most_looked ? num_looked_ + 1 : most_looked;
  }
  return room;
}

bool Failsafe::is_free(const FailsafeStop& stop, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                       const Obstacles& obstacles) noexcept {
  const Eigen::VectorXd& reach = body_.reach();
  const double way = reach.dot(stop.way()), least = std::max(least_look, way / looks_of_stop);
  double room = room_at(q, least, obstacles);
  if (room > way) {
    return true;
  }
  q_ = q;
  v_ = v;
  double moved = 0.0;
  for (int k = 0; k < stop.num_periods() && room >= 0.0; ++k) {
    stop.acceleration(k, a_);
    v_ += period_ * a_;
    const double motion = period_ * reach.dot(v_.cwiseAbs());
    if (moved > 0.0 && moved + motion > std::max(room, least)) {
      room = room_at(q_, least, obstacles);
      moved = 0.0;
    }
    moved += motion;
    q_ += period_ * v_;
  }
  return room >= 0.0 && room_at(q_, least, obstacles) >= 0.0;
}

}  // namespace sidestep
