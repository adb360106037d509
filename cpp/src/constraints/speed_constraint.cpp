#include "sidestep/constraints/speed_constraint.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double aimed = 0.98;           // Share of a limit that is aimed at [-], see the header.
constexpr double decay = 50.0;           // Rate k [1/s].
constexpr double most_per_period = 0.5;  // Largest share of the difference to the limit that a period removes [-].
constexpr double slowest = 1e-3;         // Slowest speed of a frame with a usable direction [m/s].
constexpr double shortest = 1e-6;        // Shortest gradient that counts [m/rad].

struct PlaceMotion {
  Eigen::Vector3d p, p_dot;
};

PlaceMotion motion_of(const KinematicState::Link& link, const Eigen::Vector3d& p_LF) noexcept {
  const Eigen::Vector3d p = link.p_WL + link.R_WL * p_LF;
  return {p, link.velocity.linear + link.velocity.angular.cross(p)};
}

}  // namespace

template <>
const std::vector<Field<SpeedLimitSettings>>& fields() {
  using S = SpeedLimitSettings;
  static const std::vector<Field<S>> all{
      {"near_speed", &S::near_speed, "m/s", 0.02, 10.0,
       "largest speed of any frame of the arm at near_distance from an obstacle or closer"},
      {"near_distance", &S::near_distance, "m", 0.0, 10.0, "distance to obstacles up to which near_speed is the limit"},
      {"far_speed", &S::far_speed, "m/s", 0.02, 10.0,
       "largest speed of any frame of the arm at far_distance from obstacles or farther"},
      {"far_distance", &S::far_distance, "m", 0.01, 10.0,
       "distance to obstacles from which far_speed is the limit; between near_distance and far_distance the limit rises "
       "with distance: the closer the two, the harder the arm has to brake"},
  };
  return all;
}

double SpeedLimitSettings::allowed(double distance) const noexcept {
  const double share = std::clamp((distance - near_distance) / (far_distance - near_distance), 0.0, 1.0);
  return std::sqrt(near_speed * near_speed + share * (far_speed * far_speed - near_speed * near_speed));
}

void SpeedLimitSettings::validate() const {
  check_fields("speed_limits: ", *this);
  require(near_speed <= far_speed, "speed_limits: near_speed", near_speed, "no more than far_speed");
  require(near_distance < far_distance, "speed_limits: near_distance", near_distance, "less than far_distance");
}

FrameSpeeds::FrameSpeeds(const Robot& robot) {
  for (std::size_t f = 0; f < robot.frames().size(); ++f) {
    const Frame& frame = robot.frames()[f];
    const Eigen::Vector3d p = frame.X_JF.translation();
    const auto same = [&](const Place& place) { return place.joint == frame.joint && place.p == p; };
    if (frame.joint >= 0 && std::none_of(places_.begin(), places_.end(), same)) {
      places_.push_back({static_cast<int>(f), frame.joint, p});
    }
  }
}

FrameSpeeds::Fastest FrameSpeeds::fastest(const KinematicState& state) const noexcept {
  Fastest found;
  for (const Place& place : places_) {
    const double speed = motion_of(state.link(place.joint), place.p).p_dot.norm();
    if (speed > found.speed) {
      found = {speed, place.frame};
    }
  }
  return found;
}

SpeedConstraint::SpeedConstraint(const Robot& robot) : speeds_(robot), frames_(speeds_.places().size(), -1) {}

void SpeedConstraint::append(const Moment& now, Bounds&, RowBlock& rows) noexcept {
  if (now.speed.state == nullptr) {
    return;
  }
  const KinematicState& state = *now.speed.state;
  const double limit = now.speed.limit, period = now.period;
  const double k = std::min(decay, most_per_period / period);
  const double falls = aimed * (now.speed.next_limit - limit) / period;
  const double stop_time = state.v().cwiseAbs().cwiseQuotient(*now.speed.acceleration_limits).maxCoeff();
  for (const FrameSpeeds::Place& place : speeds_.places()) {
    const KinematicState::Link& link = state.link(place.joint);
    const auto [p, p_dot] = motion_of(link, place.p);
    const double speed = p_dot.norm();
    if (!(speed > slowest)) {
      continue;
    }
    const Eigen::Vector3d n = p_dot / speed;
    const Eigen::Vector3d bias = link.bias.linear + link.bias.angular.cross(p) + link.velocity.angular.cross(p_dot);
    auto normal = rows.normals.row(rows.size);
    normal.setZero();
    const SpatialForce along{p.cross(n), n};
    for (int j = place.joint; j >= 0; j = state.link(j).parent) {
      const KinematicState::Link& joint = state.link(j);
      normal[joint.coordinate] += joint.screw.angular.dot(along.angular) + joint.screw.linear.dot(along.linear);
    }
    const double length = normal.norm();
    if (!(length > shortest)) {
      continue;
    }
    normal /= length;
    // Without acceleration limits a stop takes no time, and a row may ask for anything.
    const double stop = stop_time > 0.0 ? -speed / stop_time : -speed / period;
    rows.upper[rows.size] = std::max(falls + k * (aimed * limit - speed) - n.dot(bias), stop) / length;
    rows.lengths[rows.size] = length;
    frames_[static_cast<std::size_t>(rows.size++)] = place.frame;
  }
}

void SpeedConstraint::report(const Moment&, const Bounds&, const RowBlock& rows, const Eigen::VectorXd& wanted,
                             MotionSolution& solution) const noexcept {
  double largest = 0.0;
  for (int k = 0; k < rows.size; ++k) {
    const double slack = rows.shortfall(k, solution.acceleration, wanted.norm());
    if (slack > solution.speed_slack || (solution.speed_slack == 0.0 && rows.multipliers[k] > largest)) {
      solution.speed_slack = slack;
      solution.speed_frame = frames_[static_cast<std::size_t>(k)];
      largest = rows.multipliers[k];
    }
  }
  if (solution.speed_slack > 0.0) {
    solution.status = std::max(solution.status, ProgramStatus::relaxed);
  }
}

}  // namespace sidestep
