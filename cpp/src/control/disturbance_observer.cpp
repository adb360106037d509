#include "sidestep/control/disturbance_observer.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr double quick_filter = 0.01, slow_filter = 0.1;  // [s] time constants of the two filters
constexpr double memory = 3.0;              // [s] of the sums
constexpr double settled = 0.15;            // [s] for which a joint has moved one way
constexpr double moving = 0.02;             // [rad/s | m/s]
constexpr double explained = 0.3;            // of the missing force's variation that the acceleration has to explain [-]
constexpr double adoption = 0.05;            // [s] in which a new estimate is taken over
constexpr double least_square = 2.0;        // [(rad/s²)² s] of excitation that counts as much as the guess of no rotor

}  // namespace

DisturbanceObserver::DisturbanceObserver(const JointLimits& limits, double period, double time, double share)
    : period_(period),
      share_of_period_(std::min(1.0, period / time)),
      most_disturbance_(share * limits.effort),
      most_rotor_(limits.effort.cwiseQuotient(limits.acceleration)),
      disturbance_(Eigen::VectorXd::Zero(limits.effort.size())),
      rotors_(disturbance_),
      acceleration_(disturbance_),
      quick_a_(disturbance_),
      slow_a_(disturbance_),
      quick_y_(disturbance_),
      slow_y_(disturbance_),
      squares_(disturbance_),
      products_(disturbance_),
      missing_squares_(disturbance_),
      one_way_(disturbance_),
      last_v_(disturbance_) {}

void DisturbanceObserver::identify(Eigen::Index j, double v, double a, double y) noexcept {
  const double of_quick = std::min(1.0, period_ / quick_filter), of_slow = std::min(1.0, period_ / slow_filter);
  quick_a_[j] += of_quick * (a - quick_a_[j]);
  slow_a_[j] += of_slow * (a - slow_a_[j]);
  quick_y_[j] += of_quick * (y - quick_y_[j]);
  slow_y_[j] += of_slow * (y - slow_y_[j]);
  one_way_[j] = std::abs(v) > moving && v * last_v_[j] > 0.0 ? one_way_[j] + period_ : 0.0;
  last_v_[j] = v;
  if (one_way_[j] < settled) {
    return;
  }
  const double x = quick_a_[j] - slow_a_[j], of_x = quick_y_[j] - slow_y_[j];
  const double keep = std::exp(-period_ / memory * std::min(1.0, x * x));  // what is not excited is not forgotten
  squares_[j] = keep * squares_[j] + period_ * x * x;
  products_[j] = keep * products_[j] + period_ * x * of_x;
  missing_squares_[j] = keep * missing_squares_[j] + period_ * of_x * of_x;
  // Only what is proportional to the acceleration is inertia: payloads move several joints, torques that lag behind none.
  const bool proportional = products_[j] > 0.0 && products_[j] * products_[j] > explained * squares_[j] * missing_squares_[j];
  const double found = proportional ? products_[j] / (squares_[j] + least_square) : 0.0;
  const double most = std::isfinite(most_rotor_[j]) ? most_rotor_[j] : 0.0;
  rotors_[j] += std::min(1.0, period_ / adoption) * (std::min(found, most) - rotors_[j]);
}

void DisturbanceObserver::update(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::VectorXd& torque,
                                 const Eigen::VectorXd& predicted, const Eigen::MatrixXd& mass_matrix,
                                 const Eigen::VectorXd& bias) noexcept {
  acceleration_ = (after - before) / period_;
  for (Eigen::Index j = 0; j < disturbance_.size(); ++j) {
    const double moved = mass_matrix.row(j).dot(acceleration_);
    const double surplus = moved - mass_matrix.row(j).dot(predicted) + rotors_[j] * (acceleration_[j] - predicted[j]);
    const double missing = torque[j] - bias[j] - moved;
    if (!std::isfinite(surplus) || !std::isfinite(missing)) {
      continue;
    }
    disturbance_[j] = std::clamp(disturbance_[j] + share_of_period_ * surplus, -most_disturbance_[j], most_disturbance_[j]);
    identify(j, after[j], acceleration_[j], missing);
  }
}

}  // namespace sidestep
