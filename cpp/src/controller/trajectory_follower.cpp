#include "trajectory_follower.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "../math/settings.hpp"
#include "sidestep/planning/plan.hpp"

namespace sidestep {
namespace {

constexpr double rate_foresight = 0.01;  // time in which the clock's acceleration changes [s]
constexpr double usable_jerk = 0.5;      // share of the jerk limits for the clock [-]
constexpr double braking_share =
    0.45;                              // share of the clock's deceleration before what blocks the path: before clearances brake
constexpr double steepest = 50.0;      // change of the clock's rate where the arm stands, at most [1/s]
constexpr double least_change = 0.1;   // share of the acceleration limits for the clock where the path's bends take them [-]
constexpr double window_beyond = 0.2;  // part of the path that is looked at ahead of the way to a halt [s]
constexpr double station = 0.01;       // part of the path between two looks, where it is narrow [s]
constexpr double far = 0.3;            // clearance beyond which farther is as good [m]
constexpr int looks = 2, first_looks = 8;     // looks in a step, and in that which takes the request
constexpr double prismatic_lead = 0.2;        // share of inputs.lead of prismatic joints [m/rad]
constexpr double sudden = 0.002;              // time of acceleration below which velocities begin and end at once [s]
constexpr double waiting_rate = 0.05;         // rate of the clock below which the trajectory waits [-]
constexpr double from_now = -1.0;             // place where the path is looked at: anew [s]
constexpr double receding = 0.001;            // distance by which the path may come nearer than the arm is already [m]
constexpr double least_deviation = 0.01;      // deviation from a trajectory that counts as following it [rad]
constexpr double prismatic_deviation = 0.2;   // the same of prismatic joints, as a share of that [m/rad]
constexpr double delay_in_words = 0.01;       // delay that is worth a word [s]
constexpr double deviation_in_words = 0.001;  // deviation that is worth a word [rad | m]

}  // namespace

TrajectoryMemory::TrajectoryMemory(Eigen::Index nv)
    : begin_q(Eigen::VectorXd::Zero(nv)), begin_v(begin_q), path_q(begin_q), path_v(begin_q), path_a(begin_q) {}

TrajectoryFollower::TrajectoryFollower(const ClearanceQuery& body, const JointLimits& limits, const JointKinds& joints,
                                       const ControllerSettings& settings, const UsableLimits& usable)
    : TrajectoryMemory(limits.lower.size()),
      body_(body),
      workspace_(body),
      limits_(limits),
      joints_(joints),
      settings_(settings),
      usable_(usable),
      seen_q_(begin_q),
      seen_v_(begin_q),
      seen_a_(begin_q),
      last_seen_q_(begin_q),
      velocity_(begin_q),
      acceleration_(begin_q) {}

void TrajectoryFollower::begin(TrajectoryRequest& request, const Reference& reference) noexcept {
  begin_q = reference.q;
  begin_v = reference.v;
  request.path.begin_at(reference.q, reference.v);
  clock = TrajectoryClock{};
  clock.rate = starting_rate(request.path, 0.0, reference.v);
}

void TrajectoryFollower::begin_anew() noexcept {
  clock.rate = clock.change = 0.0;
  clock.seen = from_now;
}

void TrajectoryFollower::go_on_from(const TrajectoryFollower& before) noexcept {
  static_cast<TrajectoryMemory&>(*this) = before;
  clock.seen = from_now;
  clock.free = clock.time;
  clock.blocked = false;
  clock.blocker = {};
}

double TrajectoryFollower::starting_rate(const JointTrajectory& path, double s, const Eigen::VectorXd& v) noexcept {
  path.sample(s, path_q, path_v, path_a);
  const double square = path_v.squaredNorm(), along = path_v.dot(v);
  const double moves = along < square ? std::max(0.0, along / square) : 1.0;
  double at_once = 1.0;
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    at_once = std::min(at_once, sudden * usable_.acceleration[j] / std::abs(path_v[j]));
  }
  return std::min(path.rate(s), std::max(moves, at_once));
}

bool TrajectoryFollower::follow(const TrajectoryRequest& request, double age, double pace, const Reference& reference,
                                const Obstacles& obstacles, const Tick& tick, InputTarget& target) noexcept {
  run_clock(request, age, pace, reference, obstacles, tick);
  JointGoal& motion = target.joint_motion();
  motion.position = path_q;
  motion.velocity = clock.rate * path_v;
  motion.acceleration = clock.rate * clock.rate * path_a + clock.change * path_v;
  if (has_ended(request) && request.behaviour == TrajectoryBehaviour::steer) {
    motion.velocity.setZero();
    motion.acceleration.setZero();
    return false;
  }
  // ω² e + 2 ω de/dt, with velocities from which it can still brake. The reference's velocity is of half a period ago, as positions
  // are the sums of velocities.
  const double w = settings_.inputs.frequency;
  for (Eigen::Index j = 0; j < path_q.size(); ++j) {
    const double error = path_q[j] - reference.q[j];
    const double back = std::min(0.5 * w * std::abs(error), std::sqrt(usable_.acceleration[j] * std::abs(error)));
    const double ahead = motion.velocity[j] - 0.5 * tick.period * motion.acceleration[j];
    velocity_[j] = std::clamp(ahead + std::copysign(back, error), -usable_.velocity[j], usable_.velocity[j]);
    acceleration_[j] = motion.acceleration[j] + 2.0 * w * (velocity_[j] - reference.v[j]);
  }
  target.accelerate(reference, velocity_, acceleration_);
  target.wait(request.behaviour == TrajectoryBehaviour::keep_path && clock.blocked && clock.rate < waiting_rate);
  return true;
}

void TrajectoryFollower::run_clock(const TrajectoryRequest& request, double age, double pace, const Reference& reference,
                                   const Obstacles& obstacles, const Tick& tick) noexcept {
  const double T = tick.held;
  const JointTrajectory& path = request.path;
  TrajectoryClock& c = clock;
  // On to now, as the last step said.
  const bool leads = path.stands_at_first() && c.time < path.first();
  c.time = std::min(path.duration(), c.time + std::max(0.0, T * c.rate + 0.5 * T * T * c.change));
  c.rate = std::clamp(c.rate + T * c.change, 0.0, 1.0);
  if (leads && c.time >= path.first()) {
    c.time = path.first();
    c.rate = starting_rate(path, c.time, reference.v);
    c.change = 0.0;
  }
  path.sample(c.time, path_q, path_v, path_a);
  if (!(c.time < path.duration())) {
    c.rate = c.change = 0.0;
    c.allowed = 1.0;
    c.blocked = false;
    return;
  }
  c.delay = std::max(0.0, age - path.stamp(c.time));
  const Agility most = agility(reference.q);
  double rate =
      std::max(std::min(1.0, sudden * most.change), std::min(path.rate(c.time), path.rate(c.time + rate_foresight * c.rate)));
  rate *= pace * std::clamp(2.0 - most.lag / settings_.inputs.lead, 0.0, 1.0);
  if (request.behaviour == TrajectoryBehaviour::keep_path) {
    look_along(path, 0.5 * c.rate * c.rate / (braking_share * most.change) + window_beyond, age == 0.0, obstacles);
    if (c.free < path.duration()) {
      const double left = c.free - c.time - c.rate * most.change / most.change_rate;
      rate = std::min(rate, std::sqrt(2.0 * braking_share * most.change * std::max(0.0, left)));
    }
  }
  set_change(rate, most, tick.period);
}

TrajectoryFollower::Agility TrajectoryFollower::agility(const Eigen::VectorXd& q) const noexcept {
  Agility most{steepest, infinity, 0.0};
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double speed = std::abs(path_v[j]), limit = usable_.acceleration[j];
    const double left = limit - clock.rate * clock.rate * std::abs(path_a[j]);
    most.change = std::min(most.change, std::max(left, least_change * limit) / speed);
    most.change_rate = std::min(most.change_rate, usable_jerk * limits_.jerk[j] / speed);
    most.lag = std::max(most.lag, std::abs(path_q[j] - q[j]) / (joints_.slides(j) ? prismatic_lead : 1.0));
  }
  most.change_rate = std::min(most.change_rate, steepest / rate_foresight);
  return most;
}

void TrajectoryFollower::set_change(double allowed, const Agility& most, double T) noexcept {
  TrajectoryClock& c = clock;
  c.allowed = allowed;
  const double left = allowed - c.rate;
  const double wanted =
      std::copysign(std::min({most.change, std::sqrt(most.change_rate * std::abs(left)), 0.5 * std::abs(left) / T}), left);
  c.change = std::clamp(wanted, c.change - most.change_rate * T, c.change + most.change_rate * T);
  if (c.rate + T * c.change < 0.0 || c.rate + T * c.change > 1.0) {
    c.change = ((c.change < 0.0 ? 0.0 : 1.0) - c.rate) / T;
  }
}

void TrajectoryFollower::look_along(const JointTrajectory& path, double window, bool first,
                                    const Obstacles& obstacles) noexcept {
  TrajectoryClock& c = clock;
  const double end = std::min(path.duration(), c.time + window);
  c.free = std::max(c.free, c.time);
  for (int k = first ? first_looks : looks; k > 0; --k) {
    const bool begins = c.seen < c.time;
    if (begins) {
      c.seen = c.time;
    }
    path.sample(c.seen, seen_q_, seen_v_, seen_a_);
    const ClearanceQuery::Nearest nearest = body_.nearest(seen_q_, obstacles, far, workspace_);
    if (begins) {  // where it is near already it may go on, not nearer
      const bool touches = body_.label(std::max(0, nearest.item)).kind != CoordinateLabel::Kind::effort;
      // What it allowed itself before stays: 1 mm less with each look would lead it on to the obstacle.
      const double anew = std::min(settings_.safety.margin, nearest.clearance - receding);
      c.clearance =
          touches ? std::max(anew, std::min(c.clearance, nearest.clearance)) : std::min(c.clearance, settings_.safety.margin);
    }
    if (nearest.clearance < c.clearance) {
      c.free = std::min(c.free, std::max(c.time, c.seen - station));
      c.blocked = true;
      c.blocker = nearest;
      c.seen = from_now;
      continue;
    }
    const double last = last_free(path, c.seen, end, nearest.clearance - c.clearance);
    if (last > c.free) {
      c.free = last;
      c.blocked = false;
    }
    c.seen = last < end ? std::min(end, last + station) : from_now;
  }
}

bool TrajectoryFollower::is_slowed() const noexcept {
  for (Eigen::Index j = 0; j < path_v.size(); ++j) {
    if (std::abs(path_v[j]) * (1.0 - clock.allowed) > joint_tolerance(path_v, j, joints_.slides(j))) {
      return true;
    }
  }
  return false;
}

double TrajectoryFollower::last_free(const JointTrajectory& path, double begin, double end, double distance_left) noexcept {
  last_seen_q_ = seen_q_;
  double last = begin, next = begin;
  while (last == next && last < end) {
    next = std::min(end, next + station);
    path.sample(next, seen_q_, seen_v_, seen_a_);
    if (body_.reach().dot((seen_q_ - last_seen_q_).cwiseAbs()) < distance_left) {
      last = next;
    }
  }
  return last;
}

double TrajectoryFollower::judge_deviation(const TrajectoryRequest& request, const Eigen::VectorXd& q) noexcept {
  if (clock.time < request.path.first()) {
    return (path_q - q).cwiseAbs().maxCoeff(&farthest);
  }
  const JointTrajectory::Deviation off = request.path.deviation(clock.time, q);
  farthest = off.joint;
  return off.value;
}

bool TrajectoryFollower::is_off(double deviation) const noexcept {
  return deviation > (joints_.slides(farthest) ? prismatic_deviation : 1.0) * least_deviation;
}

std::string TrajectoryFollower::explain(double delay, double deviation, bool keeps_path, const Obstacles& obstacles) const {
  char text[96];
  std::string words;
  if (delay > delay_in_words) {
    std::snprintf(text, sizeof text, "%.2g s behind the trajectory", delay);
    words += text;
  }
  if (deviation > deviation_in_words) {
    const bool slides = joints_.slides(farthest);
    std::snprintf(text, sizeof text, "%s%.2g %s off %s", words.empty() ? "" : ", ", (slides ? 1e3 : 1.0) * deviation,
                  slides ? "mm" : "rad", words.empty() ? "the trajectory" : "it");
    words += text;
  }
  if (clock.blocked && keeps_path) {
    const CoordinateLabel& label = body_.label(clock.blocker.item);
    words += (words.empty() ? "" : ": ") + std::string("the path ahead is blocked by ") +
             (label.kind == CoordinateLabel::Kind::obstacle ? obstacles.words_for(clock.blocker.point)
              : label.kind == CoordinateLabel::Kind::effort ? describe({label, -1, 0.0, {}})
              : label.other.empty() ? "a plane"
                                    : "the arm itself, links '" + label.name + "' and '" + label.other + "'");
  }
  return words;
}

}  // namespace sidestep
