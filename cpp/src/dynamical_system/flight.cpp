#include "sidestep/dynamical_system/flight.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sidestep {
namespace {

constexpr double share_of_limits = 0.9;
constexpr double largest_acceleration = 100.0;  // of joints without an acceleration limit [/s²]
constexpr double stiffness = 10.0;              // ω [1/s]

}  // namespace

Flight::Flight(const JointLimits& limits, const Eigen::VectorXd& q, const Eigen::VectorXd& v, Eigen::VectorXd refuge,
               double period)
    : fastest_(share_of_limits * limits.velocity),
      hardest_(share_of_limits * limits.acceleration.cwiseMin(largest_acceleration)),
      refuge_(std::move(refuge)),
      position_(q),
      velocity_(v),
      acceleration_(Eigen::VectorXd::Zero(q.size())) {
  plan(period);
}

void Flight::advance(double period) noexcept {
  position_ += period_ * velocity_ + 0.5 * period_ * period_ * acceleration_;
  velocity_ += period_ * acceleration_;
  plan(period);
}

void Flight::plan(double period) noexcept {
  period_ = period;
  for (Eigen::Index j = 0; j < position_.size(); ++j) {
    const double left = refuge_[j] - position_[j], side = left < 0.0 ? -1.0 : 1.0;
    const double v = side * velocity_[j], A = hardest_[j];
    const double room = std::abs(left) - 0.5 * period * v, step = A * period;
    const double stops = room > 0.0 ? std::sqrt(step * step + 2.0 * A * room) - step : 0.0;
    acceleration_[j] = side * std::clamp((std::min(stops, fastest_[j]) - v) / period, -A, A);
  }
}

Eigen::VectorXd Flight::acceleration(const Eigen::VectorXd& q, const Eigen::VectorXd& v) const {
  return acceleration_ + stiffness * stiffness * (position_ - q) + 2.0 * stiffness * (velocity_ - v);
}

}  // namespace sidestep
