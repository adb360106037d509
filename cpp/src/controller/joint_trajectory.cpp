#include "sidestep/controller/joint_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "../settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double shortest_station = 0.005;  // [s] between rates
constexpr double most_stations = 20000.0;
constexpr double standing = 1e-9;  // [rad/s | m/s]

void refuse_trajectory(const std::string& what) { throw std::invalid_argument("controller: trajectory: " + what); }

void check_samples(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::VectorXd& times) {
  const int nv = robot.num_coordinates();
  if (times.size() == 0 || q.rows() != nv || q.cols() != times.size()) {
    refuse_trajectory(std::to_string(q.cols()) + " samples of " + std::to_string(q.rows()) + " joints at " +
                      std::to_string(times.size()) + " times; needed are as many samples as times, at least one, of " +
                      std::to_string(nv) + " joints");
  }
  for (Eigen::Index k = 0; k < times.size(); ++k) {
    const double least = k == 0 ? 0.0 : times[k - 1];
    if (!std::isfinite(times[k]) || (k == 0 ? times[k] < 0.0 : times[k] <= least)) {
      refuse_trajectory("time " + std::to_string(k) + " is " + std::to_string(times[k]) +
                        " s, allowed: " + (k == 0 ? "0 or more" : "more than the one before, " + std::to_string(least)));
    }
    for (int j = 0; j < nv; ++j) {
      const double lower = robot.limits().lower[j], upper = robot.limits().upper[j];
      if (!(q(j, k) >= lower - JointLimits::rounding && q(j, k) <= upper + JointLimits::rounding && std::isfinite(q(j, k)))) {
        refuse_trajectory("joint '" + robot.coordinate_names()[static_cast<std::size_t>(j)] + "' of sample " +
                          std::to_string(k) + " is " + std::to_string(q(j, k)) + ", allowed: " + std::to_string(lower) +
                          " to " + std::to_string(upper) + (robot.slides(j) ? " m" : " rad"));
      }
    }
  }
}

}  // namespace

JointTrajectory::JointTrajectory(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::VectorXd& times,
                                 const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) {
  check_samples(robot, q, times);
  led_ = times[0] > 0.0;
  turns_ = unlimited_joints(robot);
  first_ = times[0];
  const Eigen::Index begin = led_ ? 1 : 0, num = times.size();
  times_ = Eigen::VectorXd::Zero(begin + num);
  times_.tail(num) = times;
  q_ = Eigen::MatrixXd::Zero(q.rows(), begin + num);
  q_.rightCols(num) =
      q.array().max(robot.limits().lower.replicate(1, num).array()).min(robot.limits().upper.replicate(1, num).array());
  v_ = Eigen::MatrixXd::Zero(q.rows(), begin + num);
  const auto slope = [&](Eigen::Index k) { return Eigen::VectorXd((q_.col(k + 1) - q_.col(k)) / (times_[k + 1] - times_[k])); };
  const auto span = [&](Eigen::Index k) { return times_[k + 1] - times_[k]; };
  const Eigen::Index last = begin + num - 1;
  for (Eigen::Index k = begin; k <= last && num > 1; ++k) {
    if (num == 2) {
      v_.col(k) = slope(begin);
      continue;
    }
    // The parabola through three samples, of which k is the middle one or an end.
    const Eigen::Index middle = std::clamp(k, begin + 1, last - 1);
    const Eigen::VectorXd before = slope(middle - 1), after = slope(middle);
    const double h = span(middle - 1), next = span(middle);
    const Eigen::VectorXd bend = (after - before) / (h + next);  // half the second derivative
    v_.col(k) = before + h * bend;
    if (k != middle) {
      v_.col(k) = k < middle ? Eigen::VectorXd(before - h * bend) : Eigen::VectorXd(after + next * bend);
    }
  }
  limit_rates(velocity, acceleration);
}

void JointTrajectory::begin_at(ConstVectorRef q, ConstVectorRef v) noexcept {
  const Eigen::Index begin = led_ ? 1 : 0;
  for (Eigen::Index j = 0; j < q_.rows(); ++j) {
    if (turns_[static_cast<std::size_t>(j)]) {
      q_.row(j).array() += 2.0 * std::numbers::pi * std::round((q[j] - q_(j, begin)) / (2.0 * std::numbers::pi));
    }
  }
  if (led_) {
    q_.col(0) = q;
    v_.col(0) = v;
  }
}

void JointTrajectory::sample(double s, Eigen::VectorXd& q, Eigen::VectorXd& v, Eigen::VectorXd& a) const noexcept {
  const Eigen::Index num = times_.size();
  if (!(s < duration())) {
    q = q_.col(num - 1);
    v.setZero();
    a.setZero();
    return;
  }
  s = std::max(s, 0.0);
  const Eigen::Index k = std::upper_bound(times_.data(), times_.data() + num, s) - times_.data() - 1;
  const double h = times_[k + 1] - times_[k], u = (s - times_[k]) / h;
  const double b = u * u * (3.0 - 2.0 * u);  // share of the second sample
  q = (1.0 - b) * q_.col(k) + b * q_.col(k + 1) + h * u * (1.0 - u) * ((1.0 - u) * v_.col(k) - u * v_.col(k + 1));
  v = 6.0 * u * (1.0 - u) / h * (q_.col(k + 1) - q_.col(k)) + (1.0 - u) * (1.0 - 3.0 * u) * v_.col(k) -
      u * (2.0 - 3.0 * u) * v_.col(k + 1);
  a = (6.0 * (1.0 - 2.0 * u) / h * (q_.col(k + 1) - q_.col(k)) - (4.0 - 6.0 * u) * v_.col(k) -
       (2.0 - 6.0 * u) * v_.col(k + 1)) /
      h;
}

double JointTrajectory::rate(double s) const noexcept {
  if (!(s < duration())) {
    return 0.0;
  }
  if (!(s >= first_)) {
    return 1.0;
  }
  const double place = (s - first_) / station_;
  const auto k = std::min(static_cast<std::size_t>(place), squares_.size() - 2);
  const double share = std::min(place - static_cast<double>(k), 1.0);
  return std::sqrt((1.0 - share) * squares_[k] + share * squares_[k + 1]);
}

void JointTrajectory::limit_rates(const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) {
  const double length = duration() - first_;
  station_ = std::max({shortest_station, length / most_stations});
  const auto num = static_cast<std::size_t>(std::ceil(length / station_)) + 1;
  station_ = num > 1 ? length / static_cast<double>(num - 1) : shortest_station;
  squares_.assign(std::max<std::size_t>(num, 2), 0.0);  // a rest at the end
  Eigen::VectorXd q(q_.rows()), v(q), a(q);
  for (std::size_t k = num - 1; k-- > 0;) {
    sample(first_ + static_cast<double>(k) * station_, q, v, a);
    double most = 1.0, slope = infinity;  // of y, and of its fall to the next station
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      if (std::abs(v[j]) > standing) {
        most = std::min(most, std::pow(velocity[j] / std::abs(v[j]), 2));
      }
      if (std::abs(a[j]) > standing) {
        most = std::min(most, acceleration[j] / std::abs(a[j]));
      }
    }
    const double after = squares_[k + 1];
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      if (std::abs(v[j]) > standing) {
        const double along = v[j] > 0.0 ? a[j] : -a[j];
        slope = std::min(slope, 2.0 * std::max(0.0, acceleration[j] + along * after) / std::abs(v[j]));
      }
    }
    squares_[k] = std::min(most, after + station_ * slope);
  }
}

}  // namespace sidestep
