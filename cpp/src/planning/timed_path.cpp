#include "sidestep/planning/timed_path.hpp"

#include <algorithm>
#include <cmath>

#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr double spacing = 0.05;         // of places [rad]
constexpr double fine = 0.01;            // of stations [rad]
constexpr double seen = 0.1;             // clearance from which it bounds no speed [m]
constexpr double least_room = 0.001;     // [m]
constexpr double left_to_the_arm = 0.95;  // of the limits
constexpr double unmeasured = 0.35;      // of the limits
constexpr double of_closing = 0.8;       // of the speed at which a clearance may close: rows that bind are not smooth
constexpr double at_samples = 0.88;      // of the jerk: between samples it is up to an eighth more
constexpr double free_velocity = 2.0, free_acceleration = 10.0;

/// p⁻¹ of SafetyRows: the speed [m/s] at which a clearance with this room may close.
double closing_speed(double room, double A, double rate) {
  return room <= A / (rate * rate) ? rate * room : std::sqrt(std::max(0.0, 2.0 * A * room - A * A / (rate * rate)));
}

}  // namespace

template <>
const std::vector<Field<TimedPathSettings>>& fields() {
  using S = TimedPathSettings;
  static const std::vector<Field<S>> all{
      {"wide", &S::wide, "m", 0.001, 0.1, "clearance below which a place is narrow: barriers leave room there"},
      {"lead", &S::lead, "rad", 0.01, 3.0, "distance at which the reference waits for the arm: larger is faster and cuts corners"},
  };
  return all;
}

void TimedPathSettings::validate() const {
  check_fields("timed path: ", *this);
}

PathLimits path_limits(const JointLimits& limits, double speed) {
  const auto finite = [&](const Eigen::VectorXd& given, double otherwise) {
    return Eigen::VectorXd(left_to_the_arm * speed * given.unaryExpr([&](double x) { return std::isfinite(x) ? x : otherwise; }));
  };
  PathLimits all{finite(limits.velocity, free_velocity), finite(limits.acceleration, free_acceleration), {}};
  all.jerk = at_samples * limits.jerk.unaryExpr(
                              [](double x) { return std::isfinite(x) ? x : JointLimits::default_jerk * free_acceleration; });
  return all;
}

Eigen::Index TimedPath::place_after(double station) const noexcept {
  const auto next = std::upper_bound(place_station.begin(), place_station.end(), station) - place_station.begin();
  return std::min<Eigen::Index>(next, place_station.size() - 1);
}

TimedPath make_route(const RoundedPath& path, const Eigen::VectorXd& v, const BodyClearance& body, const Obstacles& obstacles,
                     const TimedPathSettings& settings, const SafetySettings& safety, BodyClearance::Workspace& workspace,
                     bool measured) {
  TimedPath route;
  route.limits = path_limits(body.robot().limits(), settings.speed * (measured ? 1.0 : unmeasured));
  const auto num = static_cast<Eigen::Index>(std::ceil(path.length() / spacing)) + 1;
  route.place_station = Eigen::VectorXd::LinSpaced(num, 0.0, path.length());
  route.place_station[0] = 0.0;
  route.places.resize(v.size(), num);
  route.clearance = Eigen::VectorXd::Zero(num);
  Eigen::MatrixXd clearances = Eigen::MatrixXd::Zero(body.num_items(), num);
  Eigen::VectorXd hardest(num);  // d²s/dt² of a straight path
  RoundedPath::Point point;
  for (Eigen::Index k = 0; k < num; ++k) {
    path.at(route.place_station[k], point);
    route.places.col(k) = point.q;
    hardest[k] = (route.limits.acceleration.array() / point.first.cwiseAbs().array().max(1e-6)).minCoeff();
    if (measured) {
      body.clearances(point.q, obstacles, seen, workspace, clearances.col(k));
      route.clearance[k] = std::min(seen, clearances.col(k).minCoeff());
    }
  }
  const Eigen::VectorXd stations = path.stations(std::max(fine, path.length() / 2000.0));
  Eigen::VectorXd fastest = Eigen::VectorXd::Constant(stations.size(), infinity);
  if (measured) {
    Eigen::VectorXd between = Eigen::VectorXd::Constant(std::max<Eigen::Index>(1, num - 1), infinity);
    for (int i = 0; i < body.num_items(); ++i) {
      const double margin = std::min(safety.margin, clearances.row(i).minCoeff());
      for (Eigen::Index k = 0; k + 1 < num; ++k) {
        const double slope = (clearances(i, k) - clearances(i, k + 1)) / (route.place_station[k + 1] - route.place_station[k]);
        if (slope > 1e-6) {
          const double room = std::max(least_room, clearances(i, k + 1) - margin);
          const double A = safety.braking_fraction * slope * std::min(hardest[k], hardest[k + 1]);
          between[k] = std::min(between[k], of_closing * closing_speed(room, A, safety.rate) / slope);
        }
      }
    }
    for (Eigen::Index i = 0; i < stations.size(); ++i) {
      const auto k = std::min(num - 2, static_cast<Eigen::Index>(stations[i] / path.length() * static_cast<double>(num - 1)));
      fastest[i] = num > 1 ? between[std::max<Eigen::Index>(0, k)] : infinity;
    }
  }
  path.at(0.0, point);
  const double squared = point.first.squaredNorm();
  const double begin = squared > 0.0 ? std::max(0.0, v.dot(point.first) / squared) : 0.0;
  route.motion = time_path(path, stations, fastest, route.limits, begin);
  return route;
}

}  // namespace sidestep
