#include "backup_manoeuvre.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double jerk_of_stops = 0.95;    // Share of the jerk limits that a stop uses [-]; the rest is reserve.
constexpr double of_margin = 0.2;         // Share of the margin that stops keep [-]: the rest gives way before the jerk limit.
constexpr double below_now = 0.0002;      // Distance by which a clearance below the usual floor may still shrink [m].
constexpr double least_spacing = 0.0002;  // Least motion between two checks [m], where the floor is lower.
constexpr int first_strides = 16;         // Number of strides into which the check first divides a stop.
constexpr double limit_rounding = 1e-6;   // Relative excess of a limit that counts as rounding.
constexpr int slower_stops = 6;           // Number of stops tried, each with half the acceleration of the one before.
constexpr int pause = 16;                 // Periods without a search after one with torque found no stop: it takes long.

}  // namespace

BackupManoeuvre::BackupManoeuvre(const ClearanceQuery& body, const JointLimits& limits, double margin)
    : body_(body),
      workspace_(body),
      limits_(limits),
      slowed_(limits),
      floor_(of_margin * margin),
      spacing_(std::max(floor_, least_spacing)),
      stop_(body.robot().num_coordinates()),
      next_stop_(stop_),
      next_q_(Eigen::VectorXd::Zero(body.robot().num_coordinates())),
      next_v_(next_q_),
      next_a_(next_q_),
      q_(next_q_),
      next_place_(next_q_),
      a_(next_q_),
      force_(next_q_),
      clearances_(Eigen::VectorXd::Zero(body.num_items())),
      floors_(clearances_),
      last_floors_(clearances_),
      places_(body, spacing_) {}

void StopTorque::of(const Eigen::VectorXd& a, Eigen::VectorXd& torque) const noexcept {
  torque = bias;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    torque += a[j] * mass.col(j);
  }
}

void BackupManoeuvre::invalidate() noexcept {
  places_.invalidate();
  rechecking_ = CheckedPlaces::capacity / CheckedPlaces::rechecks_per_step;
}

bool BackupManoeuvre::keep(const GuardedMotion& now, const Obstacles& obstacles, const StopTorque* torque,
                           Eigen::VectorXd& a) noexcept {
  const auto& [q, v, last, period, as_expected] = now;
  places_.begin_step();
  rechecking_ = std::max(0, rechecking_ - 1);
  const double share = smooth_share(now, a);
  pause_ = std::max(0, pause_ - 1);
  if (pause_ > 0) {
    known_ = false;
    return false;
  }
  if (known_ && (!as_expected || period != stop_.period())) {
    known_ = false;
    find_stop(now, obstacles, torque);
  }
  const bool rises = known_ && low_;
  if (rises) {
    last_floors_ = floors_;
  }
  if (!known_ || low_) {
    set_floors(q, obstacles);
  }
  next_a_ = last + share * (a - last);
  if (share == 1.0) {
    next_a_ = a;
  }
  next_v_ = v + period * next_a_;
  next_q_ = q + period * next_v_;
  const GuardedMotion next{next_q_, next_v_, next_a_, period};
  bool found = find_stop(next, obstacles, torque);
  if (!found && rises) {  // The known stop was free above the previous floors.
    floors_ = last_floors_;
    low_ = true;
    found = find_stop(next, obstacles, torque);
  }
  if (!found) {
    // A known stop stays valid while nothing changes: checked from another place it may be below a floor, by one spacing at most.
    known_ = known_ && (rechecking_ == 0 || is_free(stop_, obstacles));
    // An arm at rest at its floors may move on all the same: the floors are then those of that place.
    const bool leaves = known_ ? stop_.num_periods() <= 0 : share == 1.0;
    if (!leaves) {
      return stop_instead(now, obstacles, torque, a);
    }
    known_ = false;
  }
  if (share < 1.0) {
    a = next_a_;
  }
  return share < 1.0;
}

bool BackupManoeuvre::stop_instead(const GuardedMotion& now, const Obstacles& obstacles, const StopTorque* torque,
                                   Eigen::VectorXd& a) noexcept {
  if (!known_ && !find_stop(now, obstacles, torque)) {
    pause_ = torque != nullptr ? pause : 0;
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

double BackupManoeuvre::smooth_share(const GuardedMotion& now, const Eigen::VectorXd& a) const noexcept {
  const Eigen::VectorXd& last = now.last;
  double share = 1.0;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    const double change = a[j] - last[j], tolerance = limit_rounding * (1.0 + std::abs(a[j]));
    const double most = limits_.acceleration[j];
    if (std::abs(change) > limits_.jerk[j] * now.period + tolerance) {
      share = std::min(share, limits_.jerk[j] * now.period / std::abs(change));
    }
    if (std::abs(a[j]) > most + tolerance) {
      share = std::min(share, std::max(0.0, (most - std::copysign(last[j], change * last[j])) / std::abs(change)));
    }
  }
  return share;
}

bool BackupManoeuvre::is_within_effort(const Eigen::VectorXd& a, const StopTorque& torque) noexcept {
  torque.of(a, force_);
  return (force_.array().abs() <= limits_.effort.array()).all();
}

bool BackupManoeuvre::plan(const GuardedMotion& from, const StopTorque* torque) noexcept {
  if (torque == nullptr) {
    return next_stop_.plan(from.q, from.v, from.last, limits_, from.period, jerk_of_stops);
  }
  // A slower stop takes less torque.
  slowed_.acceleration = limits_.acceleration;
  for (int k = 0; k < slower_stops; ++k) {
    if (!next_stop_.plan(from.q, from.v, from.last, slowed_, from.period, jerk_of_stops * torque->jerk_share)) {
      return false;
    }
    if (is_within_effort(next_stop_.hardest(), *torque)) {
      return true;
    }
    slowed_.acceleration *= 0.5;
  }
  return false;
}

bool BackupManoeuvre::find_stop(const GuardedMotion& from, const Obstacles& obstacles, const StopTorque* torque) noexcept {
  if (!plan(from, torque) || !is_free(next_stop_, obstacles)) {
    return false;
  }
  std::swap(stop_, next_stop_);
  return known_ = true;
}

void BackupManoeuvre::set_floors(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept {
  body_.clearances(q, obstacles, floor_ + below_now, workspace_, clearances_);
  low_ = false;
  for (Eigen::Index i = 0; i < floors_.size(); ++i) {
    double floor = std::min(floor_, clearances_[i] - below_now);
    if (known_) {
      floor = std::max(floors_[i], floor);
    }
    if (floor != floors_[i]) {
      floors_[i] = floor;
      places_.clear();  // Their distances are those to the floors.
    }
    low_ = low_ || floor < floor_;
  }
}

bool BackupManoeuvre::is_free(const StopTrajectory& stop, const Obstacles& obstacles) noexcept {
  const Eigen::VectorXd& reach = body_.reach();
  stop.position(0, q_);
  double distance_left = places_.distance_left_at(q_, obstacles, floors_, workspace_);
  if (distance_left > reach.dot(stop.way())) {
    return true;
  }
  // From place to place: a stride doubles after a success, and is halved after a failure.
  const int num = stop.num_periods();
  int stride = std::max(1, num / first_strides), at = 0;
  double moved = 0.0;
  while (at < num && distance_left >= 0.0) {
    stride = std::min(stride, num - at);
    stop.position(at + stride, next_place_);
    double motion = 0.0;
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      motion += reach[j] * std::abs(next_place_[j] - q_[j]);
    }
    if (moved + motion <= std::max(distance_left, spacing_) || (stride == 1 && moved == 0.0)) {
      q_.swap(next_place_);
      moved += motion;
      at += stride;
      stride *= 2;
    } else if (stride > 1) {
      stride /= 2;
    } else {
      distance_left = places_.distance_left_at(q_, obstacles, floors_, workspace_);
      moved = 0.0;
    }
  }
  return distance_left >= 0.0 && places_.distance_left_at(q_, obstacles, floors_, workspace_) >= 0.0;
}

}  // namespace sidestep
