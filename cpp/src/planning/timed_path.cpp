#include "sidestep/planning/timed_path.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double spacing = 0.05;               // Distance between places [rad].
constexpr double fine = 0.01;                  // Distance between stations [rad].
constexpr double seen = 0.1;                   // Clearance from which it bounds no speed [m].
constexpr double least_distance_left = 0.001;  // Smallest distance left that bounds the speed [m].
constexpr double left_to_the_arm = 0.95;       // Share of the limits for the path [-]: the rest is for the arm that follows.
constexpr double unmeasured = 0.35;            // Share of the limits for a path whose clearances are not measured [-].
// Share of the allowed closing speed [-]: constraints that bind make the motion less smooth.
constexpr double of_closing = 0.8;
constexpr double at_samples = 0.88;  // Share of the jerk limit at samples [-]: in between it is up to an eighth more.
// Shares of effort and of its rate for motion along the path [-]: the rest is for feedback and clearances.
constexpr double of_effort = 0.7, of_effort_rate = 0.5;
constexpr double least_share = 0.05;  // Smallest share of the acceleration limits [-], where gravity takes the effort.
// Velocity [/s] and acceleration [/s²] of joints without a limit.
constexpr double free_velocity = 2.0, free_acceleration = 10.0;
// Longest braking distance of a joint [rad | m]: beyond, no clearance can be foreseen.
constexpr double stopping = 1.5;

/// p⁻¹ of ClearanceConstraints: the speed [m/s] at which a clearance with this distance left may close.
double closing_speed(double distance_left, double A, double rate) {
  return distance_left <= A / (rate * rate) ? rate * distance_left
                                            : std::sqrt(std::max(0.0, 2.0 * A * distance_left - A * A / (rate * rate)));
}

/// What motors leave of the limits of acceleration and jerk along a path.
class TorqueReserve {
 public:
  explicit TorqueReserve(const RigidBodyDynamics& dynamics)
      : dynamics_(dynamics),
        workspace_(dynamics),
        mass_(Eigen::MatrixXd::Zero(dynamics.robot().num_coordinates(), dynamics.robot().num_coordinates())),
        gravity_(Eigen::VectorXd::Zero(mass_.rows())),
        rest_(gravity_) {}

  struct Shares {
    double acceleration, jerk;
  };
  /// At a place with direction q', where the limits allow the accelerations `hardest` and the jerk `fastest` of s.
  Shares at(const RoundedPath::Point& place, double hardest, double fastest) {
    dynamics_.mass_matrix(place.q, workspace_, mass_);
    dynamics_.bias(place.q, rest_, workspace_, gravity_);
    const JointLimits& limits = dynamics_.robot().limits();
    const Eigen::VectorXd inertia = (mass_ * place.first).cwiseAbs();
    Shares shares{1.0, 1.0};
    for (Eigen::Index i = 0; i < inertia.size(); ++i) {
      const double left = std::max(0.0, limits.effort[i] - std::abs(gravity_[i]));
      shares.acceleration = std::min(shares.acceleration, of_effort * left / std::max(inertia[i] * hardest, 1e-12));
      shares.jerk = std::min(shares.jerk, of_effort_rate * limits.effort_rate[i] / std::max(inertia[i] * fastest, 1e-12));
    }
    shares.acceleration = std::max(least_share, shares.acceleration);
    return shares;
  }

 private:
  const RigidBodyDynamics& dynamics_;
  RigidBodyDynamics::Workspace workspace_;
  Eigen::MatrixXd mass_;
  Eigen::VectorXd gravity_, rest_;
};

/// Largest ds/dt between neighbouring places [1/s] with which no clearance (items × places) [m] closes too fast, `hardest` the d²s/dt²
/// that there is at the places.
Eigen::VectorXd speeds_between(const Eigen::MatrixXd& clearances, const Eigen::VectorXd& stations,
                               const Eigen::VectorXd& hardest, const SafetySettings& safety) {
  const Eigen::Index num = stations.size();
  Eigen::VectorXd between = Eigen::VectorXd::Constant(std::max<Eigen::Index>(1, num - 1), infinity);
  for (Eigen::Index i = 0; i < clearances.rows(); ++i) {
    const double margin = std::min(safety.margin, clearances.row(i).minCoeff());
    for (Eigen::Index k = 0; k + 1 < num; ++k) {
      const double slope = (clearances(i, k) - clearances(i, k + 1)) / (stations[k + 1] - stations[k]);
      if (slope > 1e-6) {
        const double distance_left = std::max(least_distance_left, clearances(i, k + 1) - margin);
        const double A = safety.braking_fraction * slope * std::min(hardest[k], hardest[k + 1]);
        between[k] = std::min(between[k], of_closing * closing_speed(distance_left, A, safety.rate) / slope);
      }
    }
  }
  return between;
}

}  // namespace

template <>
const std::vector<Field<TimedPathSettings>>& fields() {
  using S = TimedPathSettings;
  static const std::vector<Field<S>> all{
      {"wide", &S::wide, "m", 0.001, 0.1,
       "clearance below which a place on the path counts as narrow: activation distances are shorter there"},
      {"lead", &S::lead, "rad", 0.01, 3.0,
       "distance at which the reference waits for the arm: larger is faster, but cuts corners"},
  };
  return all;
}

void TimedPathSettings::validate() const { check_fields("timed path: ", *this); }

PathLimits path_limits(const JointLimits& limits, double speed) {
  const auto finite = [&](const Eigen::VectorXd& given, double otherwise) {
    return Eigen::VectorXd(left_to_the_arm * speed *
                           given.unaryExpr([&](double x) { return std::isfinite(x) ? x : otherwise; }));
  };
  PathLimits all{finite(limits.velocity, free_velocity), finite(limits.acceleration, free_acceleration), {}};
  all.velocity = all.velocity.cwiseMin((2.0 * stopping * all.acceleration).cwiseSqrt());
  all.jerk = at_samples * limits.jerk.unaryExpr(
                              [](double x) { return std::isfinite(x) ? x : JointLimits::default_jerk * free_acceleration; });
  return all;
}

Eigen::Index TimedPath::place_after(double station) const noexcept {
  const auto next = std::upper_bound(place_station.begin(), place_station.end(), station) - place_station.begin();
  return std::min<Eigen::Index>(next, place_station.size() - 1);
}

TimedPath make_route(const RoundedPath& path, const Eigen::VectorXd& v, const ClearanceQuery& body, const Obstacles& obstacles,
                     const TimedPathSettings& settings, const SafetySettings& safety, ClearanceQuery::Workspace& workspace,
                     bool measured, const RigidBodyDynamics* dynamics) {
  TimedPath route;
  route.limits = path_limits(body.robot().limits(), settings.speed * (measured ? 1.0 : unmeasured));
  const auto num = static_cast<Eigen::Index>(std::ceil(path.length() / spacing)) + 1;
  route.place_station = Eigen::VectorXd::LinSpaced(num, 0.0, path.length());
  route.place_station[0] = 0.0;
  route.places.resize(v.size(), num);
  route.clearance = Eigen::VectorXd::Zero(num);
  Eigen::MatrixXd clearances = Eigen::MatrixXd::Zero(body.num_items(), num);
  Eigen::VectorXd hardest(num);  // Largest d²s/dt² of a straight path.
  Eigen::VectorXd usable = Eigen::VectorXd::Ones(num);
  double of_jerk = 1.0;
  std::optional<TorqueReserve> reserve;
  if (dynamics != nullptr) {
    reserve.emplace(*dynamics);
  }
  RoundedPath::Point point;
  for (Eigen::Index k = 0; k < num; ++k) {
    path.at(route.place_station[k], point);
    route.places.col(k) = point.q;
    const auto slopes = point.first.cwiseAbs().array().max(1e-6);
    hardest[k] = (route.limits.acceleration.array() / slopes).minCoeff();
    if (reserve) {
      const TorqueReserve::Shares shares = reserve->at(point, hardest[k], (route.limits.jerk.array() / slopes).minCoeff());
      usable[k] = shares.acceleration;
      hardest[k] *= usable[k];
      of_jerk = std::min(of_jerk, shares.jerk);
    }
    if (measured) {
      body.clearances(point.q, obstacles, seen, workspace, clearances.col(k));
      route.clearance[k] = std::min(seen, clearances.col(k).minCoeff());
    }
  }
  route.limits.jerk *= of_jerk;
  const Eigen::VectorXd stations = path.stations(std::max(fine, path.length() / 2000.0));
  const auto place_before = [&](double station) {
    const auto k = static_cast<Eigen::Index>(station / path.length() * static_cast<double>(num - 1));
    return std::max<Eigen::Index>(0, std::min(num - 2, k));
  };
  Eigen::VectorXd share = Eigen::VectorXd::Ones(stations.size());
  for (Eigen::Index i = 0; i < stations.size() && num > 1; ++i) {
    const Eigen::Index k = place_before(stations[i]);
    share[i] = std::min(usable[k], usable[k + 1]);
  }
  Eigen::VectorXd fastest = Eigen::VectorXd::Constant(stations.size(), infinity);
  if (measured) {
    const Eigen::VectorXd between = speeds_between(clearances, route.place_station, hardest, safety);
    for (Eigen::Index i = 0; i < stations.size() && num > 1; ++i) {
      fastest[i] = between[place_before(stations[i])];
    }
  }
  path.at(0.0, point);
  const double squared = point.first.squaredNorm();
  const double begin = squared > 0.0 ? std::max(0.0, v.dot(point.first) / squared) : 0.0;
  route.motion = time_path(path, stations, fastest, share, route.limits, begin);
  return route;
}

}  // namespace sidestep
