// Trajectories: the clock that runs along them, and what acceleration follows them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double rate_foresight = 0.01;    // [s] in which the clock's acceleration changes
constexpr double usable_jerk = 0.5;        // of the limits, for the clock
constexpr double braking_share = 0.45;     // of the clock's deceleration, before what blocks the path: before clearances brake
constexpr double steepest = 50.0;          // [1/s] of the clock's rate, where the arm stands
constexpr double least_change = 0.1;       // of the acceleration limits, for the clock where the path's bends take them
constexpr double window_beyond = 0.2;      // [s] of the path that is looked at ahead of the way to a halt
constexpr double station = 0.01;           // [s] of the path between two looks, where it is narrow
constexpr double far = 0.3;                // [m] of clearance: farther is as good
constexpr int looks = 2, first_looks = 8;  // in a step, and in that which takes the order
constexpr double sliding_lead = 0.2;       // of inputs.lead, of joints that slide [m/rad]
constexpr double sudden = 0.002;           // [s] of acceleration: velocities so small begin and end at once
constexpr double waiting_rate = 0.05;
constexpr double from_now = -1.0;   // where the path is looked at: anew
constexpr double receding = 0.001;  // [m] by which the path may come nearer than the arm is already

}  // namespace

void Controller::Impl::begin_trajectory(TrajectoryOrder& order) noexcept {
  begin_q_ = q_;
  begin_v_ = v_;
  order.path.begin_at(q_, v_);
  clock_ = Clock{};
  clock_.rate = starting_rate(order.path, 0.0);
}

// The rate at which the arm moves along the path already, or which it has at once.
double Controller::Impl::starting_rate(const JointTrajectory& path, double s) noexcept {
  path.sample(s, path_q_, path_v_, path_a_);
  const double square = path_v_.squaredNorm(), along = path_v_.dot(v_);
  const double moves = along < square ? std::max(0.0, along / square) : 1.0;
  double at_once = 1.0;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    at_once = std::min(at_once, sudden * most_a_[j] / std::abs(path_v_[j]));
  }
  return std::min(path.rate(s), std::max(moves, at_once));
}

void Controller::Impl::follow_trajectory(const TrajectoryOrder& order) noexcept {
  run_clock(order);
  JointGoal& goal = std::get<JointGoal>(input_goal_);
  goal.position = path_q_;
  goal.velocity = clock_.rate * path_v_;
  goal.acceleration = clock_.rate * clock_.rate * path_a_ + clock_.change * path_v_;
  const bool ends = clock_.time >= order.path.duration();
  if (ends && order.behaviour == TrajectoryBehaviour::steer) {
    goal.velocity.setZero();
    goal.acceleration.setZero();
    moves_ = false;  // from now on a goal like others
    begins_goal_ = true;
    return;
  }
  // ω² e + 2 ω de/dt, with velocities from which it can still brake. v_ is of half a period ago, as positions are the sums
  // of velocities.
  const double w = settings.inputs.frequency;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double error = path_q_[j] - q_[j];
    const double back = std::min(0.5 * w * std::abs(error), std::sqrt(most_a_[j] * std::abs(error)));
    const double ahead = goal.velocity[j] - 0.5 * settings.period * goal.acceleration[j];
    const double velocity = std::clamp(ahead + std::copysign(back, error), -most_v_[j], most_v_[j]);
    wanted_v_[j] = velocity;
    seen_a_[j] = goal.acceleration[j] + 2.0 * w * (velocity - v_[j]);
  }
  pull(wanted_v_, seen_a_);
  waits_ = order.behaviour == TrajectoryBehaviour::keep_path && clock_.blocked && clock_.rate < waiting_rate;
}

void Controller::Impl::run_clock(const TrajectoryOrder& order) noexcept {
  const double T = settings.period;
  Clock& c = clock_;
  // On to now, as the last period said.
  const bool leads = order.path.stands_at_first() && c.time < order.path.first();
  c.time = std::min(order.path.duration(), c.time + std::max(0.0, T * c.rate + 0.5 * T * T * c.change));
  c.rate = std::clamp(c.rate + T * c.change, 0.0, 1.0);
  if (leads && c.time >= order.path.first()) {
    c.time = order.path.first();
    c.rate = starting_rate(order.path, c.time);
    c.change = 0.0;
  }
  order.path.sample(c.time, path_q_, path_v_, path_a_);
  if (!(c.time < order.path.duration())) {
    c.rate = c.change = 0.0;
    c.allowed = 1.0;
    c.blocked = false;
    return;
  }
  c.delay = std::max(0.0, order_age_ - order.path.stamp(c.time));
  // How fast the rate may change, and how fast its change.
  double most = steepest, fastest = infinity, lag = 0.0;
  const JointLimits& limits = arm.robot().limits();
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double speed = std::abs(path_v_[j]);
    const double left = most_a_[j] - c.rate * c.rate * std::abs(path_a_[j]);
    most = std::min(most, std::max(left, least_change * most_a_[j]) / speed);
    fastest = std::min(fastest, usable_jerk * limits.jerk[j] / speed);
    lag = std::max(lag, std::abs(path_q_[j] - q_[j]) / (is_sliding_[static_cast<std::size_t>(j)] ? sliding_lead : 1.0));
  }
  fastest = std::min(fastest, steepest / rate_foresight);
  double rate = std::max(std::min(1.0, sudden * most),
                         std::min(order.path.rate(c.time), order.path.rate(c.time + rate_foresight * c.rate)));
  rate *= pace_ * std::clamp(2.0 - lag / settings.inputs.lead, 0.0, 1.0);
  if (order.behaviour == TrajectoryBehaviour::keep_path) {
    look_along(order.path, 0.5 * c.rate * c.rate / (braking_share * most) + window_beyond);
    if (c.free < order.path.duration()) {
      const double room = c.free - c.time - c.rate * most / fastest;
      rate = std::min(rate, std::sqrt(2.0 * braking_share * most * std::max(0.0, room)));
    }
  }
  c.allowed = rate;
  const double left = rate - c.rate;
  const double wanted = std::copysign(std::min({most, std::sqrt(fastest * std::abs(left)), 0.5 * std::abs(left) / T}), left);
  c.change = std::clamp(wanted, c.change - fastest * T, c.change + fastest * T);
  if (c.rate + T * c.change < 0.0 || c.rate + T * c.change > 1.0) {
    c.change = ((c.change < 0.0 ? 0.0 : 1.0) - c.rate) / T;
  }
}

void Controller::Impl::look_along(const JointTrajectory& path, double window) noexcept {
  Clock& c = clock_;
  const double end = std::min(path.duration(), c.time + window);
  c.free = std::max(c.free, c.time);
  for (int k = order_age_ == 0.0 ? first_looks : looks; k > 0; --k) {
    const bool begins = c.seen < c.time;
    if (begins) {
      c.seen = c.time;
    }
    path.sample(c.seen, seen_q_, seen_v_, seen_a_);
    const BodyClearance::Nearest nearest = body_.nearest(seen_q_, obstacles(), far, here_);
    if (begins) {  // where it is near already it may go on, not nearer
      const bool touches = body_.label(std::max(0, nearest.item)).kind != CoordinateLabel::Kind::effort;
      c.room =
          touches ? std::min(settings.safety.margin, nearest.clearance - receding) : std::min(c.room, settings.safety.margin);
    }
    if (nearest.clearance < c.room) {
      c.free = std::min(c.free, std::max(c.time, c.seen - station));
      c.blocked = true;
      c.blocker = nearest;
      c.seen = from_now;
      continue;
    }
    // On by as much as no point of the arm moves farther than there is room.
    path_step_ = seen_q_;
    double last = c.seen, next = c.seen;
    while (last == next && last < end) {
      next = std::min(end, next + station);
      path.sample(next, seen_q_, seen_v_, seen_a_);
      if (body_.reach().dot((seen_q_ - path_step_).cwiseAbs()) < nearest.clearance - c.room) {
        last = next;
      }
    }
    if (last > c.free) {
      c.free = last;
      c.blocked = false;
    }
    c.seen = last < end ? next : from_now;
  }
}

std::string Controller::Impl::explain_trajectory() const {
  const TrajectoryOrder* order = trajectory_order();
  if (order == nullptr) {
    return {};
  }
  char text[96];
  std::string words;
  if (command.delay > 0.01) {
    std::snprintf(text, sizeof text, "%.2g s behind the trajectory", command.delay);
    words += text;
  }
  if (command.deviation > 0.001) {
    const bool slides = is_sliding_[static_cast<std::size_t>(deviating_)];
    std::snprintf(text, sizeof text, "%s%.2g %s off %s", words.empty() ? "" : ", ", (slides ? 1e3 : 1.0) * command.deviation,
                  slides ? "mm" : "rad", words.empty() ? "the trajectory" : "it");
    words += text;
  }
  if (clock_.blocked && has_input() && order->behaviour == TrajectoryBehaviour::keep_path) {
    const CoordinateLabel& label = body_.label(clock_.blocker.item);
    words += (words.empty() ? "" : ": ") + std::string("the path ahead is blocked by ") +
             (label.kind == CoordinateLabel::Kind::obstacle ? obstacles().words_for(clock_.blocker.point)
              : label.kind == CoordinateLabel::Kind::effort ? describe({label, -1, 0.0, {}})
              : label.other.empty() ? "a plane"
                                    : "the arm itself, links '" + label.name + "' and '" + label.other + "'");
  }
  return words;
}

}  // namespace sidestep
