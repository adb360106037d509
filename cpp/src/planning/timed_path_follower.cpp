#include <algorithm>
#include <cmath>

#include "sidestep/planning/timed_path.hpp"

namespace sidestep {
namespace {

constexpr double first = 1.0;  // Part of the path where an arm that moved while the route was computed may enter it [rad].
constexpr double stiffness = 400.0, damping = 40.0;  // Gains of the pace [1/s², 1/s].
constexpr double most_change = 10.0;                 // Largest change of the pace [1/s].

}  // namespace

void TimedPathFollower::enter(const TimedPath& route, ConstVectorRef q, ConstVectorRef v) noexcept {
  const PathTiming& motion = route.motion;
  Eigen::Index at = 0;
  double nearest = (motion.q.col(0) - q).squaredNorm();
  for (Eigen::Index k = 1; k < motion.station.size() && motion.station[k] <= first; ++k) {
    const double squared = (motion.q.col(k) - q).squaredNorm();
    if (squared < nearest) {
      nearest = squared;
      at = k;
    }
  }
  time = static_cast<double>(at) * motion.period;
  station = motion.station[at];
  const double squared = motion.v.col(at).squaredNorm();
  pace = squared > 1e-6 ? std::clamp(v.dot(motion.v.col(at)) / squared, 0.0, 1.0) : 1.0;
  change = 0.0;
}

Eigen::Index TimedPathFollower::narrow(const TimedPath& route, const TimedPathSettings& settings,
                                       Eigen::Ref<Eigen::MatrixXd> places) const noexcept {
  const Eigen::Index from = route.place_after(station);
  const auto visit = [&](auto&& place) {
    for (Eigen::Index k = from; k >= 0 && route.place_station[k] >= station - settings.lead; --k) {
      if (route.clearance[k] < settings.wide) {
        place(k);
      }
    }
  };
  Eigen::Index all = 0, count = 0, next = 0;
  visit([&](Eigen::Index) { ++all; });
  const Eigen::Index every = std::max<Eigen::Index>(1, (all + most_places - 1) / most_places);
  visit([&](Eigen::Index k) {
    if (next++ % every == 0) {
      places.col(count++) = route.places.col(k);
    }
  });
  return count;
}

void TimedPathFollower::advance(const TimedPath& route, const TimedPathSettings& settings, ConstVectorRef q, double duration,
                                Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity,
                                Eigen::Ref<Eigen::VectorXd> acceleration) noexcept {
  const PathTiming& motion = route.motion;
  const Eigen::Index last = motion.station.size() - 1;
  const double h = motion.period;
  // Between samples the polynomial of fifth degree that has their positions, velocities and accelerations.
  const auto read = [&] {
    const Eigen::Index at = std::min(static_cast<Eigen::Index>(time / h), last);
    if (at >= last) {
      position = motion.q.col(last);
      velocity.setZero();
      acceleration.setZero();
      station = motion.station[last];
      return;
    }
    const double x = time / h - static_cast<double>(at);
    for (Eigen::Index j = 0; j < position.size(); ++j) {
      const double q0 = motion.q(j, at), v0 = h * motion.v(j, at), a0 = 0.5 * h * h * motion.a(j, at);
      const double D = motion.q(j, at + 1) - q0 - v0 - a0, V = h * motion.v(j, at + 1) - v0 - 2.0 * a0;
      const double A = h * h * motion.a(j, at + 1) - 2.0 * a0;
      const double c3 = 10.0 * D - 4.0 * V + 0.5 * A, c4 = -15.0 * D + 7.0 * V - A, c5 = 6.0 * D - 3.0 * V + 0.5 * A;
      position[j] = q0 + x * (v0 + x * (a0 + x * (c3 + x * (c4 + x * c5))));
      velocity[j] = (v0 + x * (2.0 * a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / h;
      acceleration[j] = (2.0 * a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))) / (h * h);
    }
    station = motion.station[at] + x * (motion.station[at + 1] - motion.station[at]);
  };
  read();
  // Full pace up to half the lead, none from the whole of it.
  const double lag = (position - q).norm();
  const double wanted = std::clamp(2.0 - 2.0 * lag / settings.lead, 0.0, std::min(most, 1.0));
  double low = -most_change, high = most_change;
  for (Eigen::Index j = 0; j < position.size(); ++j) {
    const double rate = velocity[j], limit = route.limits.acceleration[j];
    if (std::abs(rate) > 1e-6) {
      const double now = acceleration[j] * pace * pace, a = (-limit - now) / rate, b = (limit - now) / rate;
      low = std::max(low, std::min(a, b));
      high = std::min(high, std::max(a, b));
    }
  }
  const double before = pace;
  change = (change + stiffness * duration * (wanted - pace)) / (1.0 + duration * (damping + stiffness * duration));
  change = std::clamp(change, std::min(low, 0.0), std::max(high, 0.0));
  pace += duration * change;
  if (pace <= 0.0 || pace >= 1.0) {
    pace = std::clamp(pace, 0.0, 1.0);
    change = 0.0;
  }
  time = std::min(time + 0.5 * duration * (before + pace), static_cast<double>(last) * h);
  read();
  acceleration = pace * pace * acceleration + change * velocity;
  velocity *= pace;
}

}  // namespace sidestep
