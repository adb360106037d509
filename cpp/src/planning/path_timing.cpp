#include "sidestep/planning/path_timing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace sidestep {
namespace {

constexpr int halvings = 40;                       // Halvings of an interval of x.
constexpr int most_rounds = 8;                     // Most rounds in which acceleration shares are reduced.
constexpr double crawl = 1e-4;                     // Smallest x, so that time is finite.
constexpr double longest = 0.004, finest = 0.001;  // Longest and shortest sampling period [s].
constexpr int per_window = 5;                      // Samples per window.
constexpr double most_samples = 20'000;            // Largest number of samples.

/// The passes over stations.
class Passes {
 public:
  Passes(const RoundedPath& path, const Eigen::VectorXd& stations, const Eigen::VectorXd& fastest,
         const Eigen::VectorXd& usable, const PathLimits& limits)
      : share(usable), s_(stations), limits_(limits) {
    const Eigen::Index num = s_.size(), nv = limits.velocity.size();
    first_.resize(nv, num);
    second_.resize(nv, num);
    most_.resize(num);
    RoundedPath::Point point;
    for (Eigen::Index i = 0; i < num; ++i) {
      path.at(s_[i], point);
      first_.col(i) = point.first;
      second_.col(i) = point.second;
      double speed = fastest[i];
      for (Eigen::Index j = 0; j < nv; ++j) {
        speed = std::min(speed, limits.velocity[j] / std::max(std::abs(point.first[j]), 1e-12));
      }
      most_[i] = std::max(crawl, speed * speed);
    }
  }

  Eigen::VectorXd share;  ///< Share of the acceleration limits, at the stations.

  /// x at the stations.
  Eigen::VectorXd run(double begin) const {
    const Eigen::Index last = s_.size() - 1;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(s_.size());
    for (Eigen::Index i = last - 1; i >= 0; --i) {
      x[i] = largest(i, x[i + 1]);
    }
    x[0] = std::min(x[0], begin * begin);
    for (Eigen::Index i = 0; i < last; ++i) {
      const double way = s_[i + 1] - s_[i];
      x[i + 1] = std::min(x[i + 1], std::max(0.0, x[i] + 2.0 * way * range(i, x[i]).second));
    }
    return x;
  }

 private:
  std::pair<double, double> range(Eigen::Index i, double x) const {
    double low = -1e9, high = 1e9;
    for (Eigen::Index j = 0; j < first_.rows(); ++j) {
      const double slope = first_(j, i), bend = second_(j, i) * x, most = share[i] * limits_.acceleration[j];
      if (std::abs(slope) < 1e-9) {
        if (std::abs(bend) > most) {
          return {1.0, -1.0};
        }
        continue;
      }
      const double a = (-most - bend) / slope, b = (most - bend) / slope;
      low = std::max(low, std::min(a, b));
      high = std::min(high, std::max(a, b));
    }
    return {low, high};
  }

  /// The largest x at i from which some x <= next can be had at i + 1.
  double largest(Eigen::Index i, double next) const {
    const double way = s_[i + 1] - s_[i];
    const auto possible = [&](double x) {
      const auto [low, high] = range(i, x);
      return low <= high && low <= (next - x) / (2.0 * way) && high >= -x / (2.0 * way);
    };
    if (possible(most_[i])) {
      return most_[i];
    }
    double low = 0.0, high = most_[i];
    for (int k = 0; k < halvings; ++k) {
      const double middle = 0.5 * (low + high);
      (possible(middle) ? low : high) = middle;
    }
    return low;
  }

  const Eigen::VectorXd& s_;
  const PathLimits& limits_;
  Eigen::MatrixXd first_, second_;
  Eigen::VectorXd most_;
};

/// s over time with constant u between stations, and its integral.
class Clock {
 public:
  Clock(const Eigen::VectorXd& s, const Eigen::VectorXd& x) : s_(s), t_(s.size()), speed_(x.cwiseSqrt()), sum_(s.size()) {
    t_[0] = sum_[0] = 0.0;
    for (Eigen::Index i = 0; i + 1 < s.size(); ++i) {
      const double h = 2.0 * (s[i + 1] - s[i]) / std::max(speed_[i] + speed_[i + 1], 1e-9);
      t_[i + 1] = t_[i] + h;
      sum_[i + 1] = sum_[i] + h * s[i] + h * h * (2.0 * speed_[i] + speed_[i + 1]) / 6.0;
    }
  }

  double duration() const { return t_[t_.size() - 1]; }

  struct At {
    double sum, s, speed;
  };
  At operator()(double t) const {
    const Eigen::Index last = t_.size() - 1;
    if (t <= 0.0) {
      return {t * (s_[0] + 0.5 * speed_[0] * t), s_[0] + speed_[0] * t, speed_[0]};
    }
    if (t >= t_[last]) {
      return {sum_[last] + (t - t_[last]) * s_[last], s_[last], 0.0};
    }
    const Eigen::Index i = std::upper_bound(t_.begin(), t_.end(), t) - t_.begin() - 1;
    const double h = t - t_[i], u = (speed_[i + 1] - speed_[i]) / (t_[i + 1] - t_[i]);
    return {sum_[i] + h * (s_[i] + h * (0.5 * speed_[i] + h * u / 6.0)), s_[i] + h * (speed_[i] + 0.5 * h * u),
            speed_[i] + h * u};
  }

 private:
  const Eigen::VectorXd& s_;
  Eigen::VectorXd t_, speed_, sum_;
};

/// The averaged motion; from half a window before the start, unless it begins in motion.
PathTiming sampled(const RoundedPath& path, const Clock& clock, double window) {
  const double begin = clock(0.0).speed > 0.0 ? 0.0 : -0.5 * window, end = clock.duration() + 0.5 * window;
  PathTiming timing;
  timing.period = std::max(std::clamp(window / per_window, finest, longest), (end - begin) / most_samples);
  const auto num = static_cast<Eigen::Index>(std::ceil((end - begin) / timing.period)) + 1;
  RoundedPath::Point point;
  path.at(0.0, point);
  timing.station.resize(num);
  for (Eigen::MatrixXd* rows : {&timing.q, &timing.v, &timing.a}) {
    rows->resize(point.q.size(), num);
  }
  for (Eigen::Index k = 0; k < num; ++k) {
    const double t = begin + static_cast<double>(k) * timing.period;
    const Clock::At before = clock(t - 0.5 * window), after = clock(t + 0.5 * window);
    const double s = (after.sum - before.sum) / window, rate = (after.s - before.s) / window;
    const double u = (after.speed - before.speed) / window;
    timing.station[k] = k + 1 < num ? std::clamp(s, k > 0 ? timing.station[k - 1] : 0.0, path.length()) : path.length();
    path.at(timing.station[k], point);
    timing.q.col(k) = point.q;
    timing.v.col(k) = rate * point.first;
    timing.a.col(k) = u * point.first + rate * rate * point.second;
  }
  timing.v.col(num - 1).setZero();
  timing.a.col(num - 1).setZero();
  return timing;
}

/// By how much samples exceed the limits, as the factor of time that would meet them: 1 where they do.
Eigen::VectorXd excess(const PathTiming& timing, const PathLimits& limits) {
  const Eigen::Index num = timing.station.size();
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(num);
  for (Eigen::Index k = 0; k < num; ++k) {
    for (Eigen::Index j = 0; j < limits.velocity.size(); ++j) {
      factor[k] = std::max(factor[k], std::abs(timing.v(j, k)) / limits.velocity[j]);
      factor[k] = std::max(factor[k], std::sqrt(std::abs(timing.a(j, k)) / limits.acceleration[j]));
      if (k > 0) {
        const double jerk = (timing.a(j, k) - timing.a(j, k - 1)) / timing.period;
        factor[k] = std::max(factor[k], std::cbrt(std::abs(jerk) / limits.jerk[j]));
      }
    }
  }
  return factor;
}

}  // namespace

double PathTiming::slowest(double duration) const noexcept {
  const auto span = static_cast<Eigen::Index>(std::ceil(duration / period));
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k + span < station.size(); ++k) {
    least = std::min(least, station[k + span] - station[k]);
  }
  return least;
}

PathTiming time_path(const RoundedPath& path, const Eigen::VectorXd& stations, const Eigen::VectorXd& fastest,
                     const Eigen::VectorXd& share, const PathLimits& limits, double begin) {
  if (stations.size() < 2) {
    RoundedPath::Point point;
    path.at(0.0, point);
    return {longest, point.q, Eigen::MatrixXd::Zero(point.q.size(), 1), Eigen::MatrixXd::Zero(point.q.size(), 1),
            Eigen::VectorXd::Zero(1)};
  }
  const double window = 2.0 * limits.acceleration.cwiseQuotient(limits.jerk).maxCoeff();
  Passes passes(path, stations, fastest, share, limits);
  PathTiming timing;
  for (int round = 0;; ++round) {
    const Eigen::VectorXd x = passes.run(begin);
    timing = sampled(path, Clock(stations, x), window);
    const Eigen::VectorXd factor = excess(timing, limits);
    const double worst = factor.maxCoeff();
    if (worst <= 1.0) {
      return timing;
    }
    if (round == most_rounds) {
      timing.period *= worst;
      timing.v /= worst;
      timing.a /= worst * worst;
      return timing;
    }
    // Less of the acceleration where a sample's window lies.
    const auto around = static_cast<Eigen::Index>(std::ceil(0.5 * window / timing.period)) + 1;
    Eigen::VectorXd lower = Eigen::VectorXd::Ones(stations.size());
    for (Eigen::Index k = 0; k < factor.size(); ++k) {
      if (factor[k] <= 1.0) {
        continue;
      }
      const double from = timing.station[std::max<Eigen::Index>(0, k - around)];
      const double to = timing.station[std::min(factor.size() - 1, k + around)];
      for (Eigen::Index i =
               std::max<Eigen::Index>(0, std::upper_bound(stations.begin(), stations.end(), from) - stations.begin() - 1);
           i < stations.size() && (stations[i] <= to || stations[std::max<Eigen::Index>(0, i - 1)] <= to); ++i) {
        lower[i] = std::min(lower[i], 0.99 / (factor[k] * factor[k]));
      }
    }
    passes.share.array() *= lower.array();
  }
}

}  // namespace sidestep
