#include "sidestep/planning/avoidance_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sidestep {
namespace {

constexpr double share_of_limits = 0.9;  // Share of the limits that a trajectory uses [-]: the rest is for following it.
constexpr double unlimited_acceleration = 100.0;  // Acceleration bound of joints without a limit [/s²].
constexpr double frequency = 10.0;                // Frequency ω of the feedback [1/s].

}  // namespace

AvoidanceTrajectory::AvoidanceTrajectory(const JointLimits& limits, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                         Eigen::VectorXd target)
    : fastest_(share_of_limits * limits.velocity),
      hardest_(share_of_limits * limits.acceleration.unaryExpr(
                                     [](double limit) { return std::isfinite(limit) ? limit : unlimited_acceleration; })),
      target_(std::move(target)),
      position_(q),
      velocity_(v) {}

Eigen::VectorXd AvoidanceTrajectory::acceleration(ConstVectorRef q, ConstVectorRef v, double period) const {
  Eigen::VectorXd a(q.size());
  acceleration(q, v, period, a);
  return a;
}

void AvoidanceTrajectory::acceleration(ConstVectorRef q, ConstVectorRef v, double period,
                                       Eigen::Ref<Eigen::VectorXd> out) const noexcept {
  for (Eigen::Index j = 0; j < out.size(); ++j) {
    out[j] = frequency * frequency * (position_[j] - q[j]) + 2.0 * frequency * (velocity_[j] - v[j]) +
             reference_acceleration(j, period);
  }
}

void AvoidanceTrajectory::advance(double period) noexcept {
  for (Eigen::Index j = 0; j < position_.size(); ++j) {
    const double a = reference_acceleration(j, period);
    position_[j] += period * velocity_[j] + 0.5 * period * period * a;
    velocity_[j] += period * a;
  }
}

double AvoidanceTrajectory::reference_acceleration(Eigen::Index j, double period) const noexcept {
  const double left = target_[j] - position_[j], side = left < 0.0 ? -1.0 : 1.0;
  const double v = side * velocity_[j], A = hardest_[j];
  const double distance_left = std::abs(left) - 0.5 * period * v, step = A * period;
  const double stops = distance_left > 0.0 ? std::sqrt(step * step + 2.0 * A * distance_left) - step : 0.0;
  return side * std::clamp((std::min(stops, fastest_[j]) - v) / period, -A, A);
}

}  // namespace sidestep
