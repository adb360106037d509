#include "sidestep/controller/joint_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "../math/settings.hpp"
#include "impl.hpp"
#include "sidestep/controller/motion.hpp"

namespace sidestep {
namespace {

constexpr double shortest_station = 0.005;  // Largest distance of two rates, unless the trajectory is very long [s].
constexpr double most_stations = 20000.0;   // Number of rates that a long trajectory has, beside one for each sample.
constexpr double standing = 1e-9;           // Speed that counts as rest [rad/s | m/s].
constexpr double same_sample = 0.005;       // Time in which a sample that is there again is left out [s].
constexpr double latest_first = 3600.0;     // Latest first sample [s]: later ones are dates, of 1970 or of a boot.
constexpr double corner = 0.01;             // Largest distance of the curve from the straight lines between samples [rad].
constexpr double prismatic_corner = 0.2;    // Share of it for prismatic joints [m/rad].
constexpr double overshoot = 0.05;          // Share of `corner` that the curve may go beyond a sample where the motion turns.
constexpr double even_change = 0.2;  // Share of the acceleration limits that a moved stamp needs: the cubic needs the rest.
constexpr double most_shift = 0.2;   // Largest change of a time stamp [s]: recorders and networks stall for less.
constexpr double dwell = 0.05;       // Motion of a span, as a share of the next one's, that counts as a dwell.
constexpr int most_sweeps = 40;      // Sweeps over the time stamps: bunches of up to some ten samples spread out.
constexpr int halvings = 12;         // Bisection of a change of a stamp: to a four thousandth of it.
constexpr double deviation_window = 0.05;  // Time before and after the clock in which the nearest straight line counts [s].
constexpr Eigen::Index most_lines = 64;    // Straight lines on each side that are looked at in a step.

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
    const bool again = k > 0 && times[k] == least && q.col(k) == q.col(k - 1);  // a recorder may write a sample twice
    if (!std::isfinite(times[k]) || (k == 0 ? times[k] < 0.0 : times[k] <= least && !again)) {
      refuse_trajectory("time " + std::to_string(k) + " is " + std::to_string(times[k]) +
                        " s, allowed: " + (k == 0 ? "0 or more" : "more than the one before, " + std::to_string(least)));
    }
    if (k == 0 && times[k] > latest_first) {
      refuse_trajectory("time 0 is " + std::to_string(times[k]) + " s from now on, allowed: up to " +
                        std::to_string(latest_first) + " (subtract when the recording began)");
    }
    for (int j = 0; j < nv; ++j) {
      const double lower = robot.limits().lower[j], upper = robot.limits().upper[j];
      if (!(q(j, k) >= lower - JointLimits::rounding && q(j, k) <= upper + JointLimits::rounding && std::isfinite(q(j, k)))) {
        refuse_trajectory("joint '" + robot.coordinate_names()[static_cast<std::size_t>(j)] + "' of sample " +
                          std::to_string(k) + " is " + std::to_string(q(j, k)) + ", allowed: " + std::to_string(lower) +
                          " to " + std::to_string(upper) + (robot.is_prismatic(j) ? " m" : " rad") +
                          Plausibility::hint(robot, q.col(k)));
      }
    }
  }
}

/// Whether the velocity limits, and a share of the acceleration limits, allow the spans before and after sample k, if it is
/// there at time `at`.
bool is_feasible(const Eigen::MatrixXd& q, Eigen::Index k, double before, double at, double after,
                 const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration, double share) {
  for (Eigen::Index j = 0; j < q.rows(); ++j) {
    const double first = (q(j, k) - q(j, k - 1)) / (at - before), second = (q(j, k + 1) - q(j, k)) / (after - at);
    if (std::abs(first) > velocity[j] || std::abs(second) > velocity[j] ||
        std::abs(second - first) > share * acceleration[j] * 0.5 * (after - before)) {
      return false;
    }
  }
  return true;
}

/// Time stamps as samples could have had them. Recorders write late stamps, so that samples bunch up: a span of 1 ms between
/// two of 60. Where no arm could follow, and the faster span is the shorter one, the stamp moves between its neighbours by
/// as little as the limits ask for, at most to where both spans are equally fast. Dwells keep their stamps.
void spread_bunched_stamps(const Eigen::MatrixXd& q, const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration,
                           Eigen::Index begin, Eigen::VectorXd& times) {
  const Eigen::VectorXd stamps = times;
  std::vector<bool> bunched(static_cast<std::size_t>(times.size()));  // its stamp moved, or that beside it
  const auto way = [&](Eigen::Index k) {  // acceleration limits are finite, velocity limits need not be
    return (q.col(k + 1) - q.col(k)).cwiseAbs().cwiseQuotient(acceleration).maxCoeff();
  };
  bool moved = true;
  for (int sweep = 0; moved && sweep < most_sweeps; ++sweep) {
    moved = false;
    for (Eigen::Index k = begin + 1; k + 1 < times.size(); ++k) {
      const double before = times[k - 1], after = times[k + 1];
      const auto here = static_cast<std::size_t>(k);
      const double share = bunched[here] ? even_change : 1.0;
      if (is_feasible(q, k, before, times[k], after, velocity, acceleration, share)) {
        continue;
      }
      const double first = way(k - 1), second = way(k);
      const double even = before + (after - before) * first / (first + second);  // both spans are as fast
      if (std::min(first, second) < dwell * std::max(first, second) ||
          (even > times[k] ? times[k] - before > after - times[k] : times[k] - before < after - times[k])) {
        continue;
      }
      double from = times[k], to = std::clamp(even, stamps[k] - most_shift, stamps[k] + most_shift);
      if (is_feasible(q, k, before, to, after, velocity, acceleration, even_change)) {
        for (int i = 0; i < halvings; ++i) {
          const double half = 0.5 * (from + to);
          (is_feasible(q, k, before, half, after, velocity, acceleration, even_change) ? to : from) = half;
        }
      }
      moved = moved || std::abs(to - times[k]) > 1e-3 * (after - before);
      if (to > before && to < after) {
        times[k] = to;
        bunched[here - 1] = bunched[here] = bunched[here + 1] = true;
      }
    }
  }
}

/// Slope in a sample (Steffen 1990): of the parabola through it and its neighbours, at most twice the smaller of both spans',
/// so that each cubic is monotone. Where the motion turns it is the one that goes at most `beyond` past the sample.
double inner_slope(double before, double after, double h, double next, double beyond) {
  if (before == 0.0 || after == 0.0) {
    return 0.0;
  }
  const double parabola = (before * next + after * h) / (h + next);
  const double most = before * after > 0.0 ? 2.0 * std::min(std::abs(before), std::abs(after))
                                           : 27.0 / 4.0 * beyond / std::max(h, next);  // h u (1 - u)² is 4/27 h at most
  return std::clamp(parabola, -most, most);
}

/// The same in the first or last sample, of a span of slope `here` and length h beside one of slope `beside` and length next.
double end_slope(double here, double beside, double h, double next) {
  const double parabola = here + (here - beside) * h / (h + next);
  return parabola * here > 0.0 ? std::copysign(std::min(std::abs(parabola), 2.0 * std::abs(here)), here) : 0.0;
}

}  // namespace

JointTrajectory::JointTrajectory(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::VectorXd& times,
                                 const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) {
  check_samples(robot, q, times);
  led_ = times[0] > 0.0;
  turns_ = unlimited_joints(robot);
  first_ = times[0];
  std::vector<Eigen::Index> kept = {0};  // a recorder may write a sample twice
  for (Eigen::Index k = 1; k < times.size(); ++k) {
    if (times[k] - times[kept.back()] > same_sample || q.col(k) != q.col(kept.back())) {
      kept.push_back(k);
    }
  }
  const Eigen::Index begin = led_ ? 1 : 0, num = static_cast<Eigen::Index>(kept.size());
  times_ = Eigen::VectorXd::Zero(begin + num);
  times_.tail(num) = times(kept);
  q_ = Eigen::MatrixXd::Zero(q.rows(), begin + num);
  q_.rightCols(num) = q(Eigen::all, kept)
                          .array()
                          .max(robot.limits().lower.replicate(1, num).array())
                          .min(robot.limits().upper.replicate(1, num).array());
  for (Eigen::Index j = 0; j < q.rows(); ++j) {
    for (Eigen::Index k = begin + 1; k < begin + num && turns_[static_cast<std::size_t>(j)]; ++k) {  // the short way
      q_(j, k) -= 2.0 * std::numbers::pi * std::round((q_(j, k) - q_(j, k - 1)) / (2.0 * std::numbers::pi));
    }
  }
  stamps_ = times_;
  spread_bunched_stamps(q_, velocity, acceleration, begin, times_);
  corner_ = Eigen::VectorXd::Constant(q.rows(), corner);
  for (int j = 0; j < robot.num_coordinates(); ++j) {
    corner_[j] *= robot.is_prismatic(j) ? prismatic_corner : 1.0;
  }
  lead_end_ = Eigen::VectorXd::Zero(q.rows());
  set_slopes(begin);
  limit_rates(begin, velocity, acceleration);
}

void JointTrajectory::set_slopes(Eigen::Index begin) {
  const Eigen::Index last = times_.size() - 1;
  v_ = Eigen::MatrixXd::Zero(q_.rows(), last + 1);
  const auto span = [&](Eigen::Index k) { return times_[k + 1] - times_[k]; };
  const auto slope = [&](Eigen::Index j, Eigen::Index k) { return (q_(j, k + 1) - q_(j, k)) / span(k); };
  for (Eigen::Index k = begin; k <= last && last > begin; ++k) {
    for (Eigen::Index j = 0; j < q_.rows(); ++j) {
      if (last == begin + 1) {
        v_(j, k) = slope(j, begin);
      } else if (k == begin) {
        v_(j, k) = end_slope(slope(j, k), slope(j, k + 1), span(k), span(k + 1));
      } else if (k == last) {
        v_(j, k) = end_slope(slope(j, k - 1), slope(j, k - 2), span(k - 1), span(k - 2));
      } else {
        v_(j, k) = inner_slope(slope(j, k - 1), slope(j, k), span(k - 1), span(k), overshoot * corner_[j]);
      }
    }
    // What is across a span of length h in the slope at one of its ends takes the curve off the straight line, with that at the
    // other end by h / 4 of the larger at most.
    double most = 1.0;
    for (Eigen::Index i = std::max(begin, k - 1); i < std::min(last, k + 1); ++i) {
      const Eigen::VectorXd way = (q_.col(i + 1) - q_.col(i)).cwiseQuotient(corner_);
      const Eigen::VectorXd along = v_.col(k).cwiseQuotient(corner_);
      if (const double square = way.squaredNorm(); square > 0.0) {
        most = std::max(most, 0.25 * span(i) * (along - way * (way.dot(along) / square)).cwiseAbs().maxCoeff());
      }
    }
    v_.col(k) /= most;
  }
}

void JointTrajectory::begin_at(ConstVectorRef q, ConstVectorRef v) noexcept {
  const Eigen::Index begin = led_ ? 1 : 0;
  for (Eigen::Index j = 0; j < q_.rows(); ++j) {
    if (turns_[static_cast<std::size_t>(j)]) {
      q_.row(j).array() += 2.0 * std::numbers::pi * std::round((q[j] - q_(j, begin)) / (2.0 * std::numbers::pi));
    }
  }
  stands_ = false;
  if (!led_) {
    return;
  }
  // Slopes from -room to 3 (q_1 - q_0) / h + room keep the cubic between both ends but for `corner_`, by 4/27 h room.
  q_.col(0) = q;
  for (Eigen::Index j = 0; j < q_.rows(); ++j) {
    const double most = 3.0 * (q_(j, 1) - q_(j, 0)) / first_, room = 27.0 / 4.0 * corner_[j] / first_;
    const double lower = std::min(0.0, most) - room, upper = std::max(0.0, most) + room;
    v_(j, 0) = std::clamp(v[j], lower, upper);
    stands_ = stands_ || !(v_(j, 1) >= lower && v_(j, 1) <= upper);
  }
  if (stands_) {
    lead_end_.setZero();
  } else {
    lead_end_ = v_.col(1);
  }
}

void JointTrajectory::cubic(Eigen::Index k, double u, Eigen::VectorXd& q, Eigen::VectorXd& v,
                            Eigen::VectorXd& a) const noexcept {
  const double h = times_[k + 1] - times_[k], b = u * u * (3.0 - 2.0 * u);  // share of the second sample
  for (Eigen::Index j = 0; j < q_.rows(); ++j) {
    const double first = v_(j, k), second = led_ && k == 0 ? lead_end_[j] : v_(j, k + 1);
    const double slope = (q_(j, k + 1) - q_(j, k)) / h;
    q[j] = (1.0 - b) * q_(j, k) + b * q_(j, k + 1) + h * u * (1.0 - u) * ((1.0 - u) * first - u * second);
    v[j] = 6.0 * u * (1.0 - u) * slope + (1.0 - u) * (1.0 - 3.0 * u) * first - u * (2.0 - 3.0 * u) * second;
    a[j] = (6.0 * (1.0 - 2.0 * u) * slope - (4.0 - 6.0 * u) * first - (2.0 - 6.0 * u) * second) / h;
  }
}

Eigen::Index JointTrajectory::span_at(double s) const noexcept {
  const auto k = std::upper_bound(times_.data(), times_.data() + times_.size(), s) - times_.data() - 1;
  return std::clamp<Eigen::Index>(k, 0, std::max<Eigen::Index>(0, times_.size() - 2));
}

void JointTrajectory::sample(double s, Eigen::VectorXd& q, Eigen::VectorXd& v, Eigen::VectorXd& a) const noexcept {
  if (!(s < duration())) {
    q = q_.col(q_.cols() - 1);
    v.setZero();
    a.setZero();
    return;
  }
  s = std::max(s, 0.0);
  const Eigen::Index k = span_at(s);
  cubic(k, (s - times_[k]) / (times_[k + 1] - times_[k]), q, v, a);
}

double JointTrajectory::stamp(double s) const noexcept {
  if (times_.size() < 2 || !(s < duration())) {
    return duration();
  }
  const Eigen::Index k = span_at(s);
  return stamps_[k] + (stamps_[k + 1] - stamps_[k]) * (s - times_[k]) / (times_[k + 1] - times_[k]);
}

JointTrajectory::Deviation JointTrajectory::deviation(double s, const Eigen::VectorXd& q) const noexcept {
  const Eigen::Index begin = led_ ? 1 : 0, num = times_.size();
  const auto off = [&](Eigen::Index k, Eigen::Index next) {  // from the straight line between two samples
    double square = 0.0, along = 0.0, worst = -1.0;
    Deviation farthest;
    for (Eigen::Index j = 0; j < q_.rows(); ++j) {  // joints that slide and joints that turn, by what either may be off
      const double way = (q_(j, next) - q_(j, k)) / corner_[j];
      square += way * way;
      along += way * (q[j] - q_(j, k)) / corner_[j];
    }
    const double share = square > 0.0 ? std::clamp(along / square, 0.0, 1.0) : 0.0;
    for (Eigen::Index j = 0; j < q_.rows(); ++j) {
      const double away = std::abs(q[j] - (1.0 - share) * q_(j, k) - share * q_(j, next));
      if (away / corner_[j] > worst) {
        worst = away / corner_[j];
        farthest = {away, j};
      }
    }
    return std::pair(worst, farthest);
  };
  if (num == begin + 1) {
    return off(begin, begin).second;
  }
  const Eigen::Index here = std::max(begin, span_at(s));
  auto least = off(here, here + 1);
  const auto take_nearer = [&](const std::pair<double, Deviation>& other) {
    if (other.first < least.first) {
      least = other;
    }
  };
  for (Eigen::Index k = here; k-- > std::max(begin, here - most_lines) && times_[k + 1] >= s - deviation_window;) {
    take_nearer(off(k, k + 1));
  }
  for (Eigen::Index k = here + 1; k < std::min(num - 1, here + most_lines) && times_[k] <= s + deviation_window; ++k) {
    take_nearer(off(k, k + 1));
  }
  return least.second;
}

double JointTrajectory::rate(double s) const noexcept {
  if (!(s < duration())) {
    return 0.0;
  }
  if (!(s >= first_)) {
    return 1.0;
  }
  const auto next = std::upper_bound(stations_.begin(), stations_.end() - 1, s);
  const auto k = static_cast<std::size_t>(next - stations_.begin()) - 1;
  const double share = std::min((s - stations_[k]) / (stations_[k + 1] - stations_[k]), 1.0);
  return std::sqrt((1.0 - share) * squares_[k] + share * squares_[k + 1]);
}

void JointTrajectory::limit_rates(Eigen::Index begin, const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) {
  const double longest = std::max(shortest_station, (duration() - first_) / most_stations);
  const Eigen::Index last = times_.size() - 1;
  std::vector<Eigen::Index> spans;  // of the way from each station to the next
  for (Eigen::Index k = begin; k < last; ++k) {
    const double h = times_[k + 1] - times_[k], num = std::ceil(h / longest);
    for (double i = 0.0; i < num; ++i) {
      stations_.push_back(times_[k] + h * i / num);
      spans.push_back(k);
    }
  }
  stations_.push_back(duration());
  squares_.assign(stations_.size(), 0.0);  // a rest at the end
  Eigen::VectorXd q(q_.rows()), v(q), a(q);
  for (std::size_t i = spans.size(); i-- > 0;) {
    const Eigen::Index k = spans[i];
    const double h = times_[k + 1] - times_[k], way = stations_[i + 1] - stations_[i];
    // y at this station, and what the way to the next allows at both of its ends: the accelerations jump in samples.
    double most = 1.0, braking = infinity;
    for (const double share : {0.0, 0.5, 1.0}) {
      cubic(k, std::min(1.0, (stations_[i] + share * way - times_[k]) / h), q, v, a);
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const double speed = std::abs(v[j]), bend = std::abs(a[j]);
        if (speed > standing) {
          most = std::min(most, std::pow(velocity[j] / speed, 2));
        }
        if (bend > standing) {
          most = std::min(most, acceleration[j] / bend);
        }
      }
      squares_[i + 1] = std::min(squares_[i + 1], most);
      const double after = squares_[i + 1];
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        if (const double speed = std::abs(v[j]) / (2.0 * way); std::abs(v[j]) > standing) {  // of y'/2
          const double along = v[j] > 0.0 ? a[j] : -a[j];
          braking = std::min(braking, along > 0.0 ? after + (acceleration[j] + along * after) / speed
                                                  : (acceleration[j] + speed * after) / (speed - along));
        }
      }
    }
    squares_[i] = std::min(most, braking);
  }
}

}  // namespace sidestep
