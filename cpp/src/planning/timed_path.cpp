#include "sidestep/planning/timed_path.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr double spacing = 0.05;   // of the samples [rad]
constexpr double crawl = 0.1;      // speed that is left at the narrowest corner [rad/s]
constexpr double seen = 0.2;       // clearance from which a corner is wide [m]
constexpr Eigen::Index first = 20;  // samples among which an arm that moved while the route was made enters it

/// The speed at which a path may turn at a waypoint: what follows it with a delay leaves it there by the change of
/// velocity times that delay, and may by the clearance of what leaves.
double corner_speed(const Eigen::VectorXd& q, const Eigen::VectorXd& turn, double delay, const BodyClearance& body,
                    const Obstacles& obstacles, BodyClearance::Workspace& workspace) {
  const Eigen::VectorXd off = delay * turn;
  Eigen::VectorXd clearances(body.num_items());
  body.clearances(q, obstacles, seen, workspace, clearances);
  double speed = infinity;
  for (int i = 0; i < body.num_items(); ++i) {
    const double motion = body.motion(i, q, off, workspace);  // at 1 rad/s
    if (clearances[i] < seen && motion > 0.0) {
      speed = std::min(speed, std::max(0.0, clearances[i]) / motion);
    }
  }
  return std::max(crawl, speed);
}

}  // namespace

template <>
const std::vector<Field<TimedPathSettings>>& fields() {
  using S = TimedPathSettings;
  static const std::vector<Field<S>> all{
      {"speed", &S::speed, "rad/s", 0.01, 20.0, "largest speed of the reference along the path"},
      {"speed_share", &S::speed_share, "-", 0.01, 1.0, "of the joints' velocity limits that the reference may ask for"},
      {"acceleration", &S::acceleration, "rad/s^2", 0.01, 100.0, "at which the reference slows down ahead"},
      {"wide", &S::wide, "m", 0.001, 1.0, "clearance from which the reference goes at full speed"},
      {"slowest", &S::slowest, "-", 0.01, 1.0, "share of the speed that is left where there is no clearance"},
      {"lead", &S::lead, "rad", 0.01, 3.0, "distance at which the reference waits for the arm: larger is faster and cuts corners"},
      {"delay", &S::delay, "s", 0.001, 3.0, "by which the arm follows a corner; 1 / (e sqrt(stiffness)) of a critical spring"},
  };
  return all;
}

void TimedPathSettings::validate() const {
  check_fields("timed path: ", *this);
}

TimedPath make_route(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                 const TimedPathSettings& settings, BodyClearance::Workspace& workspace, bool measured) {
  Eigen::Index num = 1;
  const auto pieces = [&](Eigen::Index k) {
    return std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::ceil((path.col(k + 1) - path.col(k)).norm() / spacing)));
  };
  for (Eigen::Index k = 0; k + 1 < path.cols(); ++k) {
    num += pieces(k);
  }
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(num);
  TimedPath route{Eigen::MatrixXd(path.rows(), num), zero, zero, zero};
  const Eigen::VectorXd& limit = body.robot().limits().velocity;
  Eigen::Index at = 0;
  route.q.col(0) = path.col(0);
  Eigen::VectorXd before = Eigen::VectorXd::Zero(path.rows()), corner = Eigen::VectorXd::Constant(num, infinity);
  for (Eigen::Index k = 0; k + 1 < path.cols(); ++k) {
    const Eigen::VectorXd edge = path.col(k + 1) - path.col(k);
    const double length = edge.norm();
    const Eigen::VectorXd along = edge / std::max(length, 1e-12);  // a length of zero has no direction
    // No joint beyond its share, and at a corner only what goes on in the same direction.
    const double fastest = std::min(settings.speed, settings.speed_share / (along.cwiseAbs().cwiseQuotient(limit)).maxCoeff());
    const double straight = k == 0 ? 1.0 : std::max(settings.slowest, before.dot(along));
    route.speed[at] = std::min(k == 0 ? fastest : route.speed[at], fastest) * straight;
    if (k > 0 && measured) {
      corner[at] = corner_speed(path.col(k), along - before, settings.delay, body, obstacles, workspace);
    }
    const Eigen::Index count = pieces(k);
    for (Eigen::Index i = 1; i <= count; ++i) {
      ++at;
      route.q.col(at) = path.col(k) + static_cast<double>(i) / static_cast<double>(count) * edge;
      route.station[at] = route.station[at - 1] + length / static_cast<double>(count);
      route.speed[at] = fastest;
    }
    before = along;
  }
  for (Eigen::Index k = 0; k < num; ++k) {
    if (measured) {
      route.clearance[k] = body.nearest(route.q.col(k), obstacles, settings.wide, workspace).clearance;
    }
    route.speed[k] = std::min(corner[k], route.speed[k] * std::clamp(route.clearance[k] / settings.wide, settings.slowest, 1.0));
  }
  // Slow down in time: v² of the next and 2 a Δs.
  route.speed[num - 1] = 0.0;
  for (Eigen::Index k = num - 2; k >= 0; --k) {
    const double way = route.station[k + 1] - route.station[k];
    route.speed[k] = std::min(route.speed[k], std::sqrt(route.speed[k + 1] * route.speed[k + 1] + 2.0 * settings.acceleration * way));
  }
  return route;
}

void TimedPathFollower::enter(const TimedPath& route, ConstVectorRef q,
                          ConstVectorRef v) noexcept {
  at = 0;
  double nearest = (route.q.col(0) - q).squaredNorm();
  for (Eigen::Index k = 1; k < std::min(first, route.q.cols()); ++k) {
    const double squared = (route.q.col(k) - q).squaredNorm();
    if (squared < nearest) {
      nearest = squared;
      at = k;
    }
  }
  station = route.station[at];
  const Eigen::Index next = std::min(at + 1, route.q.cols() - 1);
  const double length = route.station[next] - station;
  rate = length > 0.0 ? std::max(0.0, v.dot(route.q.col(next) - route.q.col(at)) / length) : 0.0;
}

Eigen::Index TimedPathFollower::narrow(const TimedPath& route, const TimedPathSettings& settings,
                                   Eigen::Ref<Eigen::MatrixXd> places) const noexcept {
  const Eigen::Index from = std::min(at + 1, route.q.cols() - 1);
  const auto visit = [&](auto&& place) {
    for (Eigen::Index k = from; k >= 0 && route.station[k] >= station - settings.lead; --k) {
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
      places.col(count++) = route.q.col(k);
    }
  });
  return count;
}

void TimedPathFollower::advance(const TimedPath& route, const TimedPathSettings& settings, ConstVectorRef q,
                            double duration, Eigen::Ref<Eigen::VectorXd> position,
                            Eigen::Ref<Eigen::VectorXd> velocity,
                            Eigen::Ref<Eigen::VectorXd> acceleration) noexcept {
  const Eigen::Index last = route.q.cols() - 1;
  const auto share = [&]() {
    return at < last ? (station - route.station[at]) / std::max(route.station[at + 1] - route.station[at], 1e-12) : 0.0;
  };
  position = route.q.col(at);
  if (at < last) {
    position += share() * (route.q.col(at + 1) - route.q.col(at));
  }
  // Full speed up to half the lead, none from the whole of it.
  const double lag = (position - q).norm();
  const double wait = std::clamp(2.0 - 2.0 * lag / settings.lead, 0.0, 1.0);
  const double t = share();
  // Constant acceleration between two samples: v² is linear.
  const auto squared = [&](Eigen::Index k) { return route.speed[k] * route.speed[k]; };
  const double allowed = at < last ? std::sqrt((1.0 - t) * squared(at) + t * squared(at + 1)) : 0.0;
  const double before = rate;
  rate = std::min(wait * allowed, rate + settings.acceleration * duration);
  station = std::min(station + rate * duration, route.length());
  while (at < last && station >= route.station[at + 1]) {
    ++at;
  }
  if (at >= last) {
    position = route.q.col(last);
    velocity.setZero();
    acceleration.setZero();
    return;
  }
  const double length = std::max(route.station[at + 1] - route.station[at], 1e-12);
  velocity = (route.q.col(at + 1) - route.q.col(at)) / length;
  position = route.q.col(at) + (station - route.station[at]) * velocity;
  // No more than it may have: what waits for the arm stops at once.
  const double change = duration > 0.0 ? (rate - before) / duration : 0.0;
  acceleration = std::clamp(change, -settings.acceleration, settings.acceleration) * velocity;
  velocity *= rate;
}

}  // namespace sidestep
