#include "velocity_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr Eigen::Index most_held = 6;       // bounds that are held at once
constexpr double limit_distance = 0.03;     // distance to a position limit where a joint is not moved on [rad]
constexpr double prismatic_distance = 0.2;  // the same of prismatic joints, as a share of that [m/rad]
constexpr double limit_rate = 3.0;          // rate at which joints come to there [1/s]
constexpr double clearance_rate = 6.0;      // rate at which clearances come to their margins [1/s]
constexpr double least_free = 0.05;         // share of a bound's direction that those held leave, at least

}  // namespace

VelocityBounds::VelocityBounds(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings,
                               const std::vector<Eigen::Index>& clearances)
    : robot_(robot),
      joints_(joints),
      settings_(settings),
      clearances_(clearances),
      held_v_(Eigen::VectorXd::Zero(robot.num_coordinates())),
      held_(Eigen::MatrixXd::Zero(held_v_.size(), std::min<Eigen::Index>(held_v_.size(), most_held))) {}

void VelocityBounds::release_all() noexcept { held_v_.setZero(); }

double VelocityBounds::largest_speed(Eigen::Index j, double at, bool up) const noexcept {
  const JointLimits& limits = robot_.limits();
  const double off = settings_.position_margin + limit_distance * (joints_.slides(j) ? prismatic_distance : 1.0);
  return limit_rate * std::max(0.0, (up ? limits.upper[j] - at : at - limits.lower[j]) - off);
}

VelocityBounds::Bound VelocityBounds::find_worst(const Eigen::VectorXd& wanted, const Eigen::VectorXd& q,
                                                 const NearReference& near, bool clearances, bool joints) const noexcept {
  Bound worst;
  worst.excess = bound_rounding;
  for (Eigen::Index j = 0; joints && j < wanted.size(); ++j) {
    const double side = wanted[j] > 0.0 ? 1.0 : -1.0, most = largest_speed(j, q[j], side > 0.0);
    if (side * wanted[j] - most > worst.excess) {
      worst.excess = side * wanted[j] - most;
      worst.least = side * most;
      worst.joint = j;
    }
  }
  const Clearances& seen = near.clearances;
  for (const Eigen::Index k : clearances_) {
    if (!clearances || seen.nearest[k] < 0 || !(seen.values[k] < infinity)) {
      continue;
    }
    const double norm = seen.gradients.col(k).norm();
    // Obstacles that come nearer are given way to.
    const double comes = std::min(0.0, seen.rates[k] - seen.gradients.col(k).dot(near.v)) - near.closing.speed(k);
    const double least =
        -comes - clearance_rate * std::max(0.0, seen.values[k] - std::min(seen.margins[k], settings_.safety.margin));
    const double excess = norm > 0.0 ? (least - seen.gradients.col(k).dot(wanted)) / norm : 0.0;
    if (excess > worst.excess) {
      worst.excess = excess;
      worst.least = least / norm;
      worst.length = norm;
      worst.clearance = k;
    }
  }
  return worst;
}

bool VelocityBounds::hold_worst(const Eigen::VectorXd& wanted, const Eigen::VectorXd& q, const NearReference& near,
                                Eigen::Index held, FrameJacobian& projected) noexcept {
  const Bound worst = find_worst(wanted, q, near, true, true);
  const bool holds = hold(worst, near, held, projected);
  if (holds && held == 0) {
    first_.clearance = worst.clearance;
    first_.joint = worst.clearance < 0 ? worst.joint : -1;
    first_.upper = worst.joint >= 0 && wanted[worst.joint] > 0.0;
  }
  return holds;
}

bool VelocityBounds::hold(const Bound& bound, const NearReference& near, Eigen::Index held, FrameJacobian& projected) noexcept {
  auto direction = held_.col(held);
  if (bound.clearance >= 0) {
    direction = near.clearances.gradients.col(bound.clearance) / bound.length;
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
  const Vector6d seen = projected.transpose().lazyProduct(direction);
  projected -= direction.lazyProduct(seen.transpose());
  return true;
}

void VelocityBounds::keep(const Eigen::VectorXd& velocity, const Eigen::VectorXd& q, const NearReference& near,
                          Eigen::VectorXd& wanted, FrameJacobian& projected) noexcept {
  held_v_.setZero();
  wanted = velocity;
  for (Eigen::Index held = 0; held < held_.cols() && hold_worst(wanted, q, near, held, projected); ++held) {
    wanted = held_v_ + velocity;
    for (Eigen::Index k = 0; k <= held; ++k) {
      wanted -= held_.col(k).dot(velocity) * held_.col(k);
    }
  }
}

}  // namespace sidestep
