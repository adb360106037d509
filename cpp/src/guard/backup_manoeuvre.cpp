#include "backup_manoeuvre.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double jerk_of_stops = 0.95;   // of the limits
constexpr double of_margin = 0.2;        // of clearance that stops keep: the rest of the margin gives way before the jerk
constexpr double below_now = 0.0002;     // [m] by which they may come nearer, where there is less
constexpr double least_look = 0.0002;    // [m] of motion between two looks, where the floor is lower
constexpr double near_body = 0.03;       // [m] nearer than that a look is exact
constexpr double far_from_body = 1.0;    // [m] farther is as good
constexpr double far_from_moving = 0.1;  // [m] the same, where something moves: it is as far for as long as a stop takes
constexpr double early = 0.75;           // of the room at a place, up to where it serves
constexpr int looks_again = 16;          // in a step
constexpr int first_strides = 16;        // of a stop
constexpr double rounded = 1e-6;         // relative
constexpr int slower_stops = 3;          // each with half the acceleration
constexpr int pause = 16;                // [periods] after a torque's stop was looked for in vain

}  // namespace

BackupManoeuvre::BackupManoeuvre(const ClearanceQuery& body, const JointLimits& limits, double margin, double period)
    : body_(body),
      room_(body),
      limits_(limits),
      slowed_(limits),
      floor_(of_margin * margin),
      spacing_(std::max(floor_, least_look)),
      period_(period),
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
      looked_at_(Eigen::MatrixXd::Zero(next_q_.size(), most_looked)),
      looked_room_(Eigen::VectorXd::Zero(most_looked)) {}

void StopTorque::of(const Eigen::VectorXd& a, Eigen::VectorXd& torque) const noexcept {
  torque = bias;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    torque += a[j] * mass.col(j);
  }
}

void BackupManoeuvre::invalidate() noexcept {
  stale_.fill(true);
  checks_ = most_looked / looks_again;
}

bool BackupManoeuvre::keep(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& last,
                           const Obstacles& obstacles, const StopTorque* torque, Eigen::VectorXd& a) noexcept {
  left_ = looks_again;
  checks_ = std::max(0, checks_ - 1);
  // As much of the change as the limits allow.
  const double share = smooth_share(last, a);
  pause_ = std::max(0, pause_ - 1);
  if (pause_ > 0) {
    known_ = false;
    return false;
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
  next_v_ = v + period_ * next_a_;
  next_q_ = q + period_ * next_v_;
  bool found = find_stop(next_q_, next_v_, next_a_, obstacles, torque);
  if (!found && rises) {  // the stop that is known was free above the floors of before
    floors_ = last_floors_;
    low_ = true;
    found = find_stop(next_q_, next_v_, next_a_, obstacles, torque);
  }
  if (!found) {
    // What is known stays so while nothing changes: looked at from elsewhere it may be below a floor, by no more than a spacing.
    known_ = known_ && (checks_ == 0 || is_free(stop_, obstacles));
    // At rest as near as the floors are it may go on all the same: then they are those of there.
    const bool leaves = known_ ? stop_.num_periods() <= 0 : share == 1.0;
    if (!leaves) {
      return stop_instead(q, v, last, obstacles, torque, a);
    }
    known_ = false;
  }
  if (share < 1.0) {
    a = next_a_;
  }
  return share < 1.0;
}

bool BackupManoeuvre::stop_instead(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& last,
                                   const Obstacles& obstacles, const StopTorque* torque, Eigen::VectorXd& a) noexcept {
  if (!known_ && !find_stop(q, v, last, obstacles, torque)) {
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

double BackupManoeuvre::smooth_share(const Eigen::VectorXd& last, const Eigen::VectorXd& a) const noexcept {
  double share = 1.0;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    const double change = a[j] - last[j], rounding = rounded * (1.0 + std::abs(a[j]));
    const double most = limits_.acceleration[j];
    if (std::abs(change) > limits_.jerk[j] * period_ + rounding) {
      share = std::min(share, limits_.jerk[j] * period_ / std::abs(change));
    }
    if (std::abs(a[j]) > most + rounding) {
      share = std::min(share, std::max(0.0, (most - std::copysign(last[j], change * last[j])) / std::abs(change)));
    }
  }
  return share;
}

bool BackupManoeuvre::is_within_effort(const Eigen::VectorXd& a, const StopTorque& torque) noexcept {
  torque.of(a, force_);
  return (force_.array().abs() <= limits_.effort.array()).all();
}

bool BackupManoeuvre::plan(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
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

bool BackupManoeuvre::find_stop(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a,
                                const Obstacles& obstacles, const StopTorque* torque) noexcept {
  if (!plan(q, v, a, torque) || !is_free(next_stop_, obstacles)) {
    return false;
  }
  std::swap(stop_, next_stop_);
  return known_ = true;
}

void BackupManoeuvre::set_floors(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept {
  body_.clearances(q, obstacles, floor_ + below_now, room_, clearances_);
  low_ = false;
  for (Eigen::Index i = 0; i < floors_.size(); ++i) {
    double floor = std::min(floor_, clearances_[i] - below_now);
    if (known_) {
      floor = std::max(floors_[i], floor);
    }
    if (floor != floors_[i]) {
      floors_[i] = floor;
      num_looked_ = 0;  // places count by the floors
    }
    low_ = low_ || floor < floor_;
  }
}

double BackupManoeuvre::look(ConstVectorRef q, int at, const Obstacles& obstacles) noexcept {
  const double far = obstacles.tree().moves() ? far_from_moving : far_from_body;
  const double room = body_.distance_left(q, obstacles, floors_, near_body, far, room_);
  if (room >= 0.0) {
    looked_at_.col(at) = q;
  }
  looked_room_[at] = room;
  stale_[static_cast<std::size_t>(at)] = false;
  return room;
}

double BackupManoeuvre::room_at(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept {
  const Eigen::VectorXd& reach = body_.reach();
  const int num = std::min(num_looked_, most_looked);
  for (int n = 0; n < num; ++n) {
    const int at = hit_ + n < num ? hit_ + n : hit_ + n - num;
    const auto left = [&] {
      const double room = looked_room_[at] < 0.0 ? 0.0 : std::max(looked_room_[at], spacing_), least = (1.0 - early) * room;
      double rest = room;
      for (Eigen::Index j = 0; j < q.size() && rest > least; ++j) {
        rest -= reach[j] * std::abs(q[j] - looked_at_(j, at));
      }
      return rest > least ? rest : -infinity;
    };
    double room = left();
    if (room > 0.0 && stale_[static_cast<std::size_t>(at)] && left_ > 0) {
      --left_;
      look(looked_at_.col(at), at, obstacles);
      room = left();
    }
    if (room > 0.0) {
      hit_ = at;
      return room;
    }
  }
  const int at = num_looked_ % most_looked;
  const double room = look(q, at, obstacles);
  if (room >= 0.0) {
    num_looked_ = num_looked_ + 1 < 2 * most_looked ? num_looked_ + 1 : most_looked;
    hit_ = at;
  }
  return room;
}

bool BackupManoeuvre::is_free(const StopTrajectory& stop, const Obstacles& obstacles) noexcept {
  const Eigen::VectorXd& reach = body_.reach();
  stop.position(0, q_);
  double room = room_at(q_, obstacles);
  if (room > reach.dot(stop.way())) {
    return true;
  }
  // On from place to place, by strides that double and are halved.
  const int num = stop.num_periods();
  int stride = std::max(1, num / first_strides), at = 0;
  double moved = 0.0;
  while (at < num && room >= 0.0) {
    stride = std::min(stride, num - at);
    stop.position(at + stride, next_place_);
    double motion = 0.0;
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      motion += reach[j] * std::abs(next_place_[j] - q_[j]);
    }
    if (moved + motion <= std::max(room, spacing_) || (stride == 1 && moved == 0.0)) {
      q_.swap(next_place_);
      moved += motion;
      at += stride;
      stride *= 2;
    } else if (stride > 1) {
      stride /= 2;
    } else {
      room = room_at(q_, obstacles);
      moved = 0.0;
    }
  }
  return room >= 0.0 && room_at(q_, obstacles) >= 0.0;
}

}  // namespace sidestep
