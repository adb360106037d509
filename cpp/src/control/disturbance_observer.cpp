#include "sidestep/control/disturbance_observer.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr double quick_filter = 0.01, slow_filter = 0.1;  // [s] time constants of the two filters
constexpr double memory = 3.0;              // [s] of the sums
constexpr double settled = 0.15;            // [s] for which a joint has moved one way
constexpr double moving = 0.02;             // [rad/s | m/s]
constexpr double explained = 0.8;            // of the missing force's variation that the acceleration has to explain [-]
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
      acceleration_band_{disturbance_, disturbance_},
      coupled_band_(acceleration_band_),
      missing_band_(acceleration_band_),
      xx_(disturbance_),
      xz_(disturbance_),
      zz_(disturbance_),
      xy_(disturbance_),
      zy_(disturbance_),
      yy_(disturbance_),
      one_way_(disturbance_),
      last_v_(disturbance_) {}

void DisturbanceObserver::identify(Eigen::Index j, double v, double a, double coupled, double y) noexcept {
  const double of_quick = std::min(1.0, period_ / quick_filter), of_slow = std::min(1.0, period_ / slow_filter);
  const auto band = [&](Filters& filters, double value) {
    filters.quick[j] += of_quick * (value - filters.quick[j]);
    filters.slow[j] += of_slow * (value - filters.slow[j]);
    return filters.quick[j] - filters.slow[j];
  };
  const double x = band(acceleration_band_, a), z = band(coupled_band_, coupled), of_x = band(missing_band_, y);
  one_way_[j] = std::abs(v) > moving && v * last_v_[j] > 0.0 ? one_way_[j] + period_ : 0.0;
  last_v_[j] = v;
  if (one_way_[j] < settled) {
    return;
  }
  const double keep = std::exp(-period_ / memory * std::min(1.0, x * x));  // what is not excited is not forgotten
  const auto add = [&](Eigen::VectorXd& sum, double product) { sum[j] = keep * sum[j] + period_ * product; };
  add(xx_, x * x);
  add(xz_, x * z);
  add(zz_, z * z);
  add(xy_, x * of_x);
  add(zy_, z * of_x);
  add(yy_, of_x * of_x);
  // What goes with the forces of the other joints' accelerations is taken out first: a payload makes them larger too.
  const double part = zz_[j] > 0.0 ? 1.0 / zz_[j] : 0.0;
  const double square = std::max(0.0, xx_[j] - xz_[j] * xz_[j] * part), product = xy_[j] - xz_[j] * zy_[j] * part;
  const double missing = std::max(0.0, yy_[j] - zy_[j] * zy_[j] * part);
  const bool proportional = product > 0.0 && product * product > explained * square * missing;
  const double found = proportional ? product / (square + least_square) : 0.0;
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
    identify(j, after[j], acceleration_[j], moved - mass_matrix(j, j) * acceleration_[j], missing);
  }
}

}  // namespace sidestep
