#include "shape_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "rigid_motion.hpp"

namespace sidestep {
namespace {

constexpr double shape_pause = 1.0;        // Time between sets after which it is new [s]: less than two sets at 1 Hz.
constexpr double held_spacings = 1.5;      // Spacings for which the same place again says nothing new [-].
constexpr double kept_arrangement = 0.01;  // Root mean square residual up to which the points are the same [m].
constexpr double placing_error = 0.01;     // Error of a place that is no jump [m].
constexpr double straight = 2.0;           // Scatter up to which places are on a line, in units of their noise [-].
constexpr double learned_noise = 0.3;      // Share of one set in the noise that is learned [-].
constexpr double rounding = 1e-7;          // Noise of places told in single precision [m].
constexpr double slowest_shape = 1e-5;     // Least speed that is a motion [m/s].
constexpr double deviations = 2.0;         // Standard deviations that the uncertainty covers [-].

}  // namespace

ShapeMotion::ShapeMotion(Eigen::Matrix3Xd points, double time) { restart(points, time); }

void ShapeMotion::restart(const Eigen::Matrix3Xd& points, double time) {
  points_ = points;
  residual_.setZero(points.cols());
  places_.setZero();
  places_.col(0).head<3>() = points.rowwise().mean();
  times_[0] = time;
  num_ = 1;
  velocity_.setZero();
  error_ = 0.0;
  noise_ = 0.0;
}

ShapeMotion::Kind ShapeMotion::update(const Eigen::Matrix3Xd& points, double time, double largest_speed) {
  const double duration = time - times_[0];
  if (points.cols() != points_.cols()) {
    restart(points, time);
    return Kind::other;
  }
  if (duration > shape_pause) {
    const bool stayed = points == points_;
    restart(points, time);
    num_ = stayed ? most_sets : 1;
    for (int k = 1; k < num_; ++k) {  // it rests where it was
      places_.col(k) = places_.col(0);
      times_[static_cast<std::size_t>(k)] = time - k * duration;
    }
    return stayed ? Kind::same : Kind::elsewhere;
  }
  const bool stayed = points == points_, moved = !velocity_.isZero(0.0);
  if (stayed && moved && duration <= held_spacings * (times_[0] - times_[1])) {
    error_ = std::max(error_, velocity_.norm());
    return Kind::same;
  }
  if (stayed && moved) {  // it stopped, or nobody moves it any more
    restart(points, time);
    remember(places_.col(0), time);
    times_[1] = time - duration;
    return Kind::same;
  }
  const double most = largest_speed * duration + placing_error;
  const double farthest = std::sqrt((points - points_).colwise().squaredNorm().maxCoeff());
  const RigidMotion motion(points_, points);
  const double left = std::sqrt(motion.residual.squaredNorm() / static_cast<double>(points.cols()));
  if (farthest > most) {
    restart(points, time);
    return left <= kept_arrangement ? Kind::elsewhere : Kind::other;
  }
  points_ = points;
  residual_ = motion.residual / duration;
  gyration_ = motion.gyration;
  Place place;
  place << points.rowwise().mean(), places_.col(0).tail<3>() + motion.gyration * motion.rotation;
  remember(place, time);
  find_velocity();
  return Kind::same;
}

void ShapeMotion::remember(const Place& place, double time) {
  for (int k = std::min(num_, most_sets - 1); k > 0; --k) {
    places_.col(k) = places_.col(k - 1).eval();
    times_[static_cast<std::size_t>(k)] = times_[static_cast<std::size_t>(k) - 1];
  }
  places_.col(0) = place;
  times_[0] = time;
  num_ = std::min(num_ + 1, most_sets);
}

void ShapeMotion::learn_noise() {
  double squares = 0.0;
  for (int k = 0; k + 3 < num_; ++k) {
    squares += (bend(k) - bend(k + 1)).squaredNorm() / (15.0 * (num_ - 3));  // variance 5 σ² per axis
  }
  if (num_ == 3) {
    squares = bend(0).squaredNorm() / 4.5;  // variance 1.5 σ² per axis, if it is no acceleration
  }
  const double share = num_ > 4 ? learned_noise : 1.0;
  noise_ = std::max(rounding, std::sqrt((1.0 - share) * noise_ * noise_ + share * squares));
}

ShapeMotion::Place ShapeMotion::bend(int k) const {
  const auto at = static_cast<std::size_t>(k);
  const double share = (times_[at + 1] - times_[at + 2]) / (times_[at] - times_[at + 2]);
  return places_.col(k + 1) - share * places_.col(k) - (1.0 - share) * places_.col(k + 2);
}

void ShapeMotion::find_velocity() {
  const Place before = velocity_;
  learn_noise();
  LineFit<6> line(places_, times_, num_);
  int used = num_;
  while (used > 2 && line.scatter > straight * noise_) {
    line = LineFit<6>(places_, times_, --used);
  }
  velocity_ = line.velocity;
  error_ = deviations * std::sqrt(3.0) * noise_ / line.spread;
  const bool is_whole = used == num_;  // places that bend are no noise: the newest ones then only have to exceed it
  line.scatter = is_whole ? noise_ : 0.0;
  const bool moves = num_ == 2 || is_motion(line, used, is_whole ? rounding : noise_, !before.isZero(0.0));
  if (velocity_.norm() <= slowest_shape || !moves) {
    error_ = num_ < most_sets && noise_ > rounding ? velocity_.norm() + error_ : 0.0;
    velocity_.setZero();
  } else if (num_ == 2) {
    error_ = velocity_.norm();
  } else {
    const double late = bend(0).norm() * (used - 1) / (times_[0] - times_[1]);  // acceleration over half the line
    error_ += std::max(late, (velocity_ - before).norm());
  }
}

Eigen::Matrix3Xd ShapeMotion::velocities() const {
  Eigen::Matrix3Xd result(3, points_.cols());
  const Eigen::Vector3d middle = points_.rowwise().mean(), linear = velocity_.head<3>();
  const Eigen::Vector3d turning = gyration_ > 0.0 ? Eigen::Vector3d(velocity_.tail<3>() / gyration_) : Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < points_.cols(); ++n) {
    result.col(n) = linear + turning.cross(points_.col(n) - middle);
  }
  return result;
}

Eigen::VectorXd ShapeMotion::uncertainty() const { return residual_.array() + error_; }

}  // namespace sidestep
