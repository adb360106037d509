// Velocities and twists: how they are set, and what acceleration follows them.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double limit_room = 0.03;     // [rad] to a position limit, where a twist does not move a joint on
constexpr double sliding_room = 0.2;    // the same of joints that slide [m/rad]
constexpr double limit_rate = 3.0;      // [1/s] at which joints come to there
constexpr double clearance_rate = 6.0;  // [1/s] at which clearances come to their margins
constexpr double least_free = 0.05;     // share of a bound's direction that those held leave

}  // namespace

void Controller::Impl::set_velocity(const Eigen::VectorXd& v) {
  if (v.size() != q_.size()) {
    throw std::invalid_argument("controller: velocity has " + std::to_string(v.size()) +
                                " entries, allowed: " + std::to_string(q_.size()) + ", one for each joint");
  }
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    if (!std::isfinite(v[j])) {
      throw std::invalid_argument("controller: velocity of joint '" +
                                  arm.robot().coordinate_names()[static_cast<std::size_t>(j)] + "' is " + std::to_string(v[j]) +
                                  ", allowed: finite numbers");
    }
  }
  put(VelocityOrder{v});
}

void Controller::Impl::set_twist(const std::string& frame, const Vector6d& twist, bool local, TwistFreedom free) {
  if (!(free == TwistFreedom::rotation ? twist.head<3>().allFinite() : twist.allFinite())) {
    std::string numbers;
    for (const double number : twist) {
      numbers += (numbers.empty() ? "" : ", ") + std::to_string(number);
    }
    throw std::invalid_argument("controller: twist of frame '" + frame + "' is (" + numbers + "), allowed: finite numbers");
  }
  put(TwistOrder{moved_frame(arm.robot(), frame, "controller: twist"), twist, local, free});
}

void Controller::Impl::set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times, TrajectoryBehaviour behaviour) {
  TrajectoryOrder order{JointTrajectory(arm.robot(), q, times, most_v_, most_a_), behaviour,
                        std::make_shared<const TrajectorySamples>(TrajectorySamples{q, times})};
  put(std::move(order), plausible_.question_trajectory(q, times));
}

void Controller::Impl::begin_input() noexcept {
  begins_input_ = false;
  Order& order = goal_orders_.current().order;
  if (auto* trajectory = std::get_if<TrajectoryOrder>(&order)) {
    has_last_wanted_v_ = false;
    begin_trajectory(*trajectory);
  } else if (const auto* twist = std::get_if<TwistOrder>(&order); twist != nullptr && has_last_wanted_v_) {
    solve_twist(*twist);  // where the arm was before: what the arm's motion changes in it is followed without a lag
    last_wanted_v_ = wanted_v_;
  } else {
    has_last_wanted_v_ = false;
  }
}

void Controller::Impl::follow_input() noexcept {
  const Order& order = goal_orders_.current().order;
  if (const auto* trajectory = std::get_if<TrajectoryOrder>(&order)) {
    follow_trajectory(*trajectory);
  } else {
    follow_velocity(std::get_if<VelocityOrder>(&order), std::get_if<TwistOrder>(&order));
  }
}

void Controller::Impl::follow_velocity(const VelocityOrder* velocity, const TwistOrder* twist) noexcept {
  twist_state_.update(arm.robot(), q_, v_);
  held_clearance_ = held_joint_ = -1;
  reduction_ = Reduction{};
  if (twist != nullptr && is_fresh()) {
    solve_twist(*twist);
  } else {
    path_v_.setZero();
    if (is_fresh()) {
      path_v_ = velocity->velocity;
      scale_to_limits(path_v_, reduction_);
    }
    keep_bounds(path_v_);
    scale_to_limits(wanted_v_, reduction_);
    has_last_wanted_v_ = false;
  }
  wanted_v_ *= pace_;
  JointGoal& goal = std::get<JointGoal>(input_goal_);
  goal.position = q_.cwiseMax(arm.robot().limits().lower).cwiseMin(arm.robot().limits().upper);
  goal.velocity = wanted_v_;
  goal.acceleration.setZero();
  if (!has_ideal_v_) {
    ideal_v_ = v_;
    has_ideal_v_ = true;
  }
  respond(ideal_v_);
  ideal_v_ += settings.period * path_a_;
  respond(v_);
  // What bounds hold of the velocity is held: its pull needs no barriers, and is the damping's.
  JointGoal& pull = std::get<JointGoal>(input_pull_);
  pull.position = goal.position;
  pull.velocity = v_ + path_a_ / settings.barriers.damping;
  pull.acceleration.setZero();
  pulls_ = true;
  last_wanted_v_ = wanted_v_;
  has_last_wanted_v_ = twist != nullptr && is_fresh();
}

// Limits scale it as a whole: joints that reach their velocities one after the other would move the arm across what is asked.
void Controller::Impl::respond(const Eigen::VectorXd& v) noexcept {
  path_a_ = settings.inputs.response * (wanted_v_ - v);
  if (has_last_wanted_v_) {  // its own change, while the order is the same
    path_a_ += ((wanted_v_ - last_wanted_v_) / settings.period).cwiseMax(-most_a_).cwiseMin(most_a_);
  }
  double share = 1.0;
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    if (std::abs(path_a_[j]) > most_a_[j]) {
      share = std::min(share, most_a_[j] / std::abs(path_a_[j]));
    }
  }
  path_a_ *= share;
}

// Barriers hold back what a pull does towards obstacles, also where it brakes a motion away from them: that much is given to the
// damping, which they leave alone.
void Controller::Impl::pull(const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) noexcept {
  JointGoal& pull = std::get<JointGoal>(input_pull_);
  pull.position = q_.cwiseMax(arm.robot().limits().lower).cwiseMin(arm.robot().limits().upper);
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double change = velocity[j] - v_[j];
    const double braking = change * v_[j] < 0.0 ? std::copysign(std::min(std::abs(change), std::abs(v_[j])), change) : 0.0;
    pull.velocity[j] = v_[j] + braking;
    pull.acceleration[j] = acceleration[j] - settings.barriers.damping * braking;
  }
  pulled_ = acceleration;
  pulls_ = true;
}

double Controller::Impl::scale_to_limits(Eigen::VectorXd& velocity, Reduction& reduction) const noexcept {
  double share = 1.0;
  for (Eigen::Index j = 0; j < velocity.size(); ++j) {
    if (std::abs(velocity[j]) * share > most_v_[j]) {
      share = most_v_[j] / std::abs(velocity[j]);
      reduction.by = Reduction::By::speed;
      reduction.joint = j;
    }
  }
  velocity *= share;
  return share;
}

void Controller::Impl::keep_bounds(const Eigen::VectorXd& velocity) noexcept {
  held_v_.setZero();
  wanted_v_ = velocity;
  for (Eigen::Index held = 0; held < held_.cols() && hold_worst(held); ++held) {
    wanted_v_ = held_v_ + velocity;
    for (Eigen::Index k = 0; k <= held; ++k) {
      wanted_v_ -= held_.col(k).dot(velocity) * held_.col(k);
    }
  }
}

// [rad/s | m/s] How fast a joint may move on towards its limit.
double Controller::Impl::joint_room(Eigen::Index j, bool up) const noexcept {
  const JointLimits& limits = arm.robot().limits();
  const double at = twist_state_.q()[j];
  const double off = settings.position_margin + limit_room * (is_sliding_[static_cast<std::size_t>(j)] ? sliding_room : 1.0);
  return limit_rate * std::max(0.0, (up ? limits.upper[j] - at : at - limits.lower[j]) - off);
}

Controller::Impl::Bound Controller::Impl::find_worst(bool clearances, bool joints) const noexcept {
  Bound worst;
  worst.excess = bound_rounding;
  for (Eigen::Index j = 0; joints && j < wanted_v_.size(); ++j) {
    const double side = wanted_v_[j] > 0.0 ? 1.0 : -1.0, most = joint_room(j, side > 0.0);
    if (side * wanted_v_[j] - most > worst.excess) {
      worst.excess = side * wanted_v_[j] - most;
      worst.least = side * most;
      worst.joint = j;
    }
  }
  const Clearances& near = workspace.clearances;
  for (const Eigen::Index k : metric_coordinates_) {
    if (!clearances || near.nearest[k] < 0 || !(near.values[k] < infinity)) {
      continue;
    }
    const double norm = near.gradients.col(k).norm();
    // Obstacles that come nearer are given way to.
    const double comes = std::min(0.0, near.rates[k] - near.gradients.col(k).dot(workspace.state().v())) - closing_.speed(k);
    const double least =
        -comes - clearance_rate * std::max(0.0, near.values[k] - std::min(near.margins[k], settings.safety.margin));
    const double excess = norm > 0.0 ? (least - near.gradients.col(k).dot(wanted_v_)) / norm : 0.0;
    if (excess > worst.excess) {
      worst.excess = excess;
      worst.least = least / norm;
      worst.length = norm;
      worst.clearance = k;
    }
  }
  return worst;
}

bool Controller::Impl::hold_worst(Eigen::Index held) noexcept {
  const Bound worst = find_worst(true, true);
  const bool holds = hold(worst, held);
  if (holds && held == 0) {
    held_clearance_ = worst.clearance;
    held_joint_ = worst.clearance < 0 ? worst.joint : -1;
    held_upper_ = worst.joint >= 0 && wanted_v_[worst.joint] > 0.0;
  }
  return holds;
}

bool Controller::Impl::hold(const Bound& bound, Eigen::Index held) noexcept {
  auto direction = held_.col(held);
  if (bound.clearance >= 0) {
    direction = workspace.clearances.gradients.col(bound.clearance) / bound.length;
  } else if (bound.joint >= 0) {
    direction.setZero();
    direction[bound.joint] = 1.0;
  } else {
    return false;
  }
  const double missing = bound.least - direction.dot(held_v_);
  for (Eigen::Index k = 0; k < held; ++k) {
    direction -= held_.col(k).dot(direction) * held_.col(k);
  }
  const double free = direction.norm();  // of the unit that it was
  if (free < least_free) {
    return false;
  }
  direction /= free;
  held_v_ += missing / free * direction;
  const Vector6d seen = projected_.transpose().lazyProduct(direction);
  projected_ -= direction.lazyProduct(seen.transpose());
  return true;
}

}  // namespace sidestep
