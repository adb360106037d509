#include "sidestep/guidance/route.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr double spacing = 0.05;   // of the samples [rad]
constexpr Eigen::Index first = 20;  // samples among which an arm that moved while the route was made enters it

}  // namespace

void RouteSettings::validate() const {
  const auto positive = [](double value, const char* what) {
    require(value > 0.0 && value < infinity, what, value, "positive and finite");
  };
  positive(speed, "route: speed");
  positive(speed_share, "route: speed_share");
  positive(acceleration, "route: acceleration");
  positive(wide, "route: wide");
  positive(slowest, "route: slowest");
  positive(lead, "route: lead");
  if (slowest > 1.0 || speed_share > 1.0) {
    throw std::invalid_argument("route: slowest is " + std::to_string(slowest) + " and speed_share " +
                                std::to_string(speed_share) + ", shares must be at most 1");
  }
}

Route make_route(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                 const RouteSettings& settings, BodyClearance::Workspace& workspace, bool measured) {
  Eigen::Index num = 1;
  const auto pieces = [&](Eigen::Index k) {
    return std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::ceil((path.col(k + 1) - path.col(k)).norm() / spacing)));
  };
  for (Eigen::Index k = 0; k + 1 < path.cols(); ++k) {
    num += pieces(k);
  }
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(num);
  Route route{Eigen::MatrixXd(path.rows(), num), zero, zero, zero};
  const Eigen::VectorXd& limit = body.robot().limits().velocity;
  Eigen::Index at = 0;
  route.q.col(0) = path.col(0);
  Eigen::VectorXd before = Eigen::VectorXd::Zero(path.rows());
  for (Eigen::Index k = 0; k + 1 < path.cols(); ++k) {
    const Eigen::VectorXd edge = path.col(k + 1) - path.col(k);
    const double length = edge.norm();
    const Eigen::VectorXd along = edge / std::max(length, 1e-12);  // a length of zero has no direction
    // No joint beyond its share, and at a corner only what goes on in the same direction.
    const double fastest = std::min(settings.speed, settings.speed_share / (along.cwiseAbs().cwiseQuotient(limit)).maxCoeff());
    const double straight = k == 0 ? 1.0 : std::max(settings.slowest, before.dot(along));
    route.speed[at] = std::min(k == 0 ? fastest : route.speed[at], fastest) * straight;
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
    route.speed[k] *= std::clamp(route.clearance[k] / settings.wide, settings.slowest, 1.0);
  }
  // Slow down in time: v² of the next and 2 a Δs.
  route.speed[num - 1] = 0.0;
  for (Eigen::Index k = num - 2; k >= 0; --k) {
    const double way = route.station[k + 1] - route.station[k];
    route.speed[k] = std::min(route.speed[k], std::sqrt(route.speed[k + 1] * route.speed[k + 1] + 2.0 * settings.acceleration * way));
  }
  return route;
}

void RouteFollower::enter(const Route& route, Eigen::Ref<const Eigen::VectorXd> q) noexcept {
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
}

Eigen::Index RouteFollower::tightest(const Route& route, const RouteSettings& settings) const noexcept {
  Eigen::Index tightest = -1;
  double least = settings.wide;
  for (Eigen::Index k = std::min(at + 1, route.q.cols() - 1); k >= 0 && route.station[k] >= station - settings.lead; --k) {
    if (route.clearance[k] < least) {
      least = route.clearance[k];
      tightest = k;
    }
  }
  return tightest;
}

void RouteFollower::advance(const Route& route, const RouteSettings& settings, Eigen::Ref<const Eigen::VectorXd> q,
                            double duration, Eigen::Ref<Eigen::VectorXd> position,
                            Eigen::Ref<Eigen::VectorXd> velocity) noexcept {
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
  const double allowed = at < last ? (1.0 - t) * route.speed[at] + t * route.speed[at + 1] : 0.0;
  rate = std::min(wait * allowed, rate + settings.acceleration * duration);
  station = std::min(station + rate * duration, route.length());
  while (at < last && station >= route.station[at + 1]) {
    ++at;
  }
  if (at >= last) {
    position = route.q.col(last);
    velocity.setZero();
    return;
  }
  const double length = std::max(route.station[at + 1] - route.station[at], 1e-12);
  velocity = (route.q.col(at + 1) - route.q.col(at)) / length;
  position = route.q.col(at) + (station - route.station[at]) * velocity;
  velocity *= rate;
}

}  // namespace sidestep
