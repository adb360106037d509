#include "sidestep/loop/stream_limiter.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace sidestep {
namespace {

constexpr double return_frequency = 30.0;  // ω of the way back to the wanted positions [1/s]: 10 mrad cost 9 rad/s²
// Differences to what was sent that are rounding to single precision, of what is at most 2π [rad, rad/s] and 20 rad/s².
constexpr double same_position = 1e-6, same_velocity = 1e-5, same_acceleration = 1e-3;

void require_size(const Eigen::VectorXd& vector, Eigen::Index size, const char* name) {
  if (vector.size() != size) {
    throw std::invalid_argument(std::string("stream limits: ") + name + " has " + std::to_string(vector.size()) +
                                " entries, allowed: " + std::to_string(size));
  }
}

void require_positive(const Eigen::VectorXd& vector, Eigen::Index size, const char* name) {
  require_size(vector, size, name);
  for (const double value : vector) {
    if (!(value > 0.0)) {
      throw std::invalid_argument(std::string("stream limits: ") + name + " is " + std::to_string(value) +
                                  ", allowed: above 0");
    }
  }
}

void validate_stream(const StreamLimits& limits, double period) {
  const JointLimits& joints = limits.joints;
  const Eigen::Index nv = joints.velocity.size();
  require_positive(joints.velocity, nv, "velocity");
  require_positive(joints.acceleration, nv, "acceleration");
  require_positive(joints.jerk, nv, "jerk");
  require_positive(joints.effort, nv, "effort");
  require_positive(joints.effort_rate, nv, "effort_rate");
  require_size(joints.lower, nv, "lower");
  require_size(joints.upper, nv, "upper");
  if (limits.end_deceleration.size() > 0 || limits.end_offset.size() > 0) {
    require_positive(limits.end_deceleration, nv, "end_deceleration");
    require_positive(limits.end_offset, nv, "end_offset");
  }
  if (!(limits.margin >= 0.0 && limits.margin < 1.0)) {
    throw std::invalid_argument("stream limits: margin is " + std::to_string(limits.margin) + ", allowed: from 0 to below 1");
  }
  if (!(period > 0.0 && std::isfinite(period))) {
    throw std::invalid_argument("stream limits: period is " + std::to_string(period) + " s, allowed: above 0");
  }
}

// What was sent, unless the robot says something else.
double went_on(double sent, double told, double same) noexcept {
  return std::isfinite(told) && std::abs(told - sent) > same ? told : sent;
}

}  // namespace

StreamLimiter::StreamLimiter(StreamLimits limits, double period)
    : limits_(std::move(limits)), period_(period), share_(1.0 - limits_.margin) {
  validate_stream(limits_, period);
  const Eigen::Index nv = limits_.joints.velocity.size();
  p_ = v_ = a_ = torque_ = Eigen::VectorXd::Zero(nv);
}

void StreamLimiter::begin(const Eigen::VectorXd& position, const Eigen::VectorXd& torque) noexcept {
  p_ = position;
  v_.setZero();
  a_.setZero();
  torque_ = torque;
  change_ = 0.0;
}

const Eigen::VectorXd& StreamLimiter::limit_positions(const Motion& told, const Motion& wanted) noexcept {
  take(told);
  change_ = 0.0;
  for (Eigen::Index j = 0; j < p_.size(); ++j) {
    const double v = wanted.velocity[j], a = wanted.acceleration[j];
    const double slow = (v - period_ * a) - v_[j], behind = (wanted.position[j] - period_ * v) - p_[j];
    accelerate(j, within(j, a + 2.0 * return_frequency * slow + return_frequency * return_frequency * behind));
    change_ = std::max(change_, std::abs(p_[j] - wanted.position[j]));
  }
  return p_;
}

const Eigen::VectorXd& StreamLimiter::limit_velocities(const Motion& told, const Motion& wanted) noexcept {
  take(told);
  change_ = 0.0;
  for (Eigen::Index j = 0; j < v_.size(); ++j) {
    const double a = wanted.acceleration[j], slow = wanted.velocity[j] - v_[j] - period_ * a;
    const double more = braked(share_ * limits_.joints.jerk[j], std::abs(slow));
    accelerate(j, within(j, a + std::copysign(more, slow)));
    change_ = std::max(change_, std::abs(v_[j] - wanted.velocity[j]));
  }
  return v_;
}

const Eigen::VectorXd& StreamLimiter::limit_torques(const Eigen::VectorXd& told, const Eigen::VectorXd& wanted) noexcept {
  change_ = 0.0;
  for (Eigen::Index j = 0; j < torque_.size(); ++j) {
    const double holds = std::isfinite(told[j]) ? told[j] : torque_[j];
    const double step = share_ * limits_.joints.effort_rate[j] * period_, most = limits_.joints.effort[j];
    // What was sent last may have reached the robot since it said what it holds: within the rate of both, if that is possible.
    const double low = std::max(holds, torque_[j]) - step, high = std::min(holds, torque_[j]) + step;
    const double from = low <= high ? low : holds - step, to = low <= high ? high : holds + step;
    torque_[j] = std::clamp(std::clamp(wanted[j], -most, most), from, to);
    change_ = std::max(change_, std::abs(torque_[j] - wanted[j]));
  }
  return torque_;
}

void StreamLimiter::take(const Motion& told) noexcept {
  for (Eigen::Index j = 0; j < p_.size(); ++j) {
    p_[j] = went_on(p_[j], told.position[j], same_position);
    v_[j] = went_on(v_[j], told.velocity[j], same_velocity);
    a_[j] = went_on(a_[j], told.acceleration[j], same_acceleration);
  }
}

void StreamLimiter::accelerate(Eigen::Index j, double acceleration) noexcept {
  a_[j] = acceleration;
  v_[j] += period_ * acceleration;
  p_[j] += period_ * v_[j];
}

double StreamLimiter::within(Eigen::Index j, double acceleration) const noexcept {
  const double most = share_ * limits_.joints.acceleration[j], step = share_ * limits_.joints.jerk[j] * period_;
  // The last of them counts where they contradict: the robot stops itself at once for jerk.
  double a = std::clamp(acceleration, -largest_towards(j, -1.0), std::max(-largest_towards(j, -1.0), largest_towards(j, 1.0)));
  a = std::clamp(a, -most, most);
  return std::clamp(a, a_[j] - step, a_[j] + step);
}

/// Largest acceleration of a joint towards one side (±1) after which jerk still keeps it from the velocity limits there.
double StreamLimiter::largest_towards(Eigen::Index j, double side) const noexcept {
  const double v = side * v_[j];
  double most = kept_below(j, limits_.joints.velocity[j], 0.0, v);
  if (limits_.end_deceleration.size() > 0) {
    const double end = side > 0.0 ? limits_.joints.upper[j] : -limits_.joints.lower[j];
    const double D = limits_.end_deceleration[j], o = limits_.end_offset[j], towards = std::max(0.0, v);
    const double limit = std::max(0.0, std::sqrt(2.0 * D * std::max(0.0, end - side * p_[j] - period_ * towards)) - o);
    most = std::min(most, kept_below(j, limit, D * towards / (limit + o), v));
  }
  return most;
}

/// The same for one limit, which falls at a rate `falls` [/s²]; v: velocity towards it.
double StreamLimiter::kept_below(Eigen::Index j, double limit, double falls, double v) const noexcept {
  const double left = share_ * limit - v + period_ * falls;
  return (left > 0.0 ? braked(share_ * limits_.joints.jerk[j], left) : left / period_) - falls;
}

/// Largest acceleration that a jerk J brings back to 0 within a change `left` of the velocity:
///   n b T − J T² n (n − 1)/2 = left,   n: periods that it takes.
double StreamLimiter::braked(double jerk, double left) const noexcept {
  const double step = jerk * period_;
  const double periods = std::max(1.0, std::ceil(0.5 * (std::sqrt(1.0 + 8.0 * left / (step * period_)) - 1.0)));
  return left / (periods * period_) + 0.5 * step * (periods - 1.0);
}

}  // namespace sidestep
