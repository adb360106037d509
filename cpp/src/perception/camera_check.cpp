#include "sidestep/perception/camera_check.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {
namespace {

constexpr int points_of_image = 2000;   // Points of an image that are kept, about.
constexpr int rounds = 60;              // Gauss-Newton steps.
constexpr double first_reach = 0.12;    // Distance from the arm up to which points count, in the first round [m].
constexpr double last_reach = 0.02;     // The same, in the last rounds [m].
constexpr double reach_share = 0.95;    // By which this gets less from round to round.
constexpr double told_weight = 0.003;   // Weight of the pose that was told, per point [m²/rad² | 1].
constexpr double time_step = 0.005;     // Time between two states whose difference is a velocity [s].
constexpr double longest_offset = 0.3;  // Largest clock offset that is looked for [s].
constexpr double least_speed = 0.02;    // Mean speed of what is seen of the arm, below which it says nothing of a clock [m/s].
constexpr int least_images = 3;
constexpr double least_points = 200.0;  // Sum of the weights of points, below which they say nothing.
constexpr int num_unknowns = 7;         // Rotation and translation in the optical frame, and the clock offset.

using Unknowns = Eigen::Matrix<double, num_unknowns, 1>;

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle < 1e-12 ? Eigen::Matrix3d::Identity() : Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

}  // namespace

/// The sums of one fit over some of the images.
struct CameraCheck::Fit {
  /// An ellipsoid, ready for distances.
  struct Surface {
    BodyEllipsoid ellipsoid;
    Eigen::Matrix3d inverse;
    double overshoot;
  };
  /// Where the surface of the arm is nearest to a point.
  struct Hit {
    double distance = std::numeric_limits<double>::infinity();
    Eigen::Vector3d normal;  // in the world
    const Surface* surface = nullptr;
  };

  explicit Fit(const CameraCheck& of);

  Hit nearest(const Eigen::Vector3d& p, double reach) const;
  /// Adds the rows of one image.
  void add(const Image& image, double reach);
  /// One round; false where nothing can be said.
  bool step(int first, int stride, double reach, bool with_clock);
  Eigen::Isometry3d X_WC_at() const {
    return on_link < 0 ? X : Eigen::Isometry3d(frame_pose(check.arm_.robot(), now, on_link) * X);
  }

  const CameraCheck& check;
  std::vector<Surface> surfaces;
  KinematicState now, later;
  int on_link;
  Eigen::Isometry3d X;  // X_WC, or X_LC
  double offset = 0.0;
  Eigen::Matrix<double, num_unknowns, num_unknowns> H;
  Unknowns g;
  double weights = 0.0, squares = 0.0, speeds = 0.0, overshoots = 0.0;
};

CameraCheck::Fit::Fit(const CameraCheck& of)
    : check(of),
      now(of.arm_.robot()),
      later(of.arm_.robot()),
      on_link(of.camera_.link.empty() ? -1 : of.arm_.robot().frame_index(of.camera_.link)),
      X(of.camera_.pose) {
  const Arm& arm = of.arm_;
  for (const BodyEllipsoid& ellipsoid : body_ellipsoids(arm.robot(), arm.body(), "camera check")) {
    const std::string& link = arm.body().links[static_cast<std::size_t>(ellipsoid.component)];
    double overshoot = 0.0;
    for (const CoverProof& proof : arm.proof()) {
      overshoot = proof.link == link ? proof.mean_overshoot : overshoot;
    }
    surfaces.push_back({ellipsoid, ellipsoid.shape.inverse(), overshoot});
  }
}

CameraCheck::Fit::Hit CameraCheck::Fit::nearest(const Eigen::Vector3d& p, double reach) const {
  Hit hit;
  for (const Surface& surface : surfaces) {
    const KinematicState::Link& link = link_or_world(now, surface.ellipsoid.joint);
    const Eigen::Vector3d y = link.R_WL.transpose() * (p - link.p_WL) - surface.ellipsoid.mean;
    if (y.norm() > surface.ellipsoid.extent + reach) {
      continue;
    }
    const Eigen::Vector3d Ay = surface.inverse * y;
    const double f = std::sqrt(std::max(y.dot(Ay), 1e-12)), slope = std::max(Ay.norm(), 1e-9);
    const double distance = (f - 1.0) * f / slope + surface.overshoot;
    if (distance < hit.distance) {
      hit = {distance, link.R_WL * (Ay / slope), &surface};
    }
  }
  return hit;
}

void CameraCheck::Fit::add(const Image& image, double reach) {
  Eigen::VectorXd q(check.arm_.num_coordinates());
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(q.size());
  if (!check.state_at(image.time + offset + time_step, q)) {
    return;
  }
  later.update(check.arm_.robot(), q, zero);
  if (!check.state_at(image.time + offset, q)) {
    return;
  }
  now.update(check.arm_.robot(), q, zero);
  const Eigen::Isometry3d X_WC = X_WC_at();
  for (Eigen::Index n = 0; n < image.points.cols(); ++n) {
    const Eigen::Vector3d p = image.points.col(n), x = X_WC * p;
    const Hit hit = nearest(x, reach);
    if (!(std::abs(hit.distance) < reach) ||
        hit.normal.dot(x - X_WC.translation()) > 0.0) {  // too far, or near a side that is not seen
      continue;
    }
    const int joint = hit.surface->ellipsoid.joint;
    const KinematicState::Link &a = link_or_world(now, joint), &b = link_or_world(later, joint);
    const Eigen::Vector3d velocity = (b.R_WL * (a.R_WL.transpose() * (x - a.p_WL)) + b.p_WL - x) / time_step;
    const Eigen::Vector3d normal = X_WC.linear().transpose() * hit.normal;  // in the optical frame
    Unknowns row;
    row << p.cross(normal), normal, -hit.normal.dot(velocity);
    const double share = 1.0 - std::pow(hit.distance / reach, 2), weight = share * share;  // Tukey's
    H += weight * row * row.transpose();
    g += weight * hit.distance * row;
    weights += weight;
    squares += weight * hit.distance * hit.distance;
    speeds += weight * velocity.norm();
    overshoots += weight * hit.surface->overshoot;
  }
}

bool CameraCheck::Fit::step(int first, int stride, double reach, bool with_clock) {
  H.setZero();
  g.setZero();
  weights = squares = speeds = overshoots = 0.0;
  for (std::size_t n = static_cast<std::size_t>(first); n < check.images_.size(); n += static_cast<std::size_t>(stride)) {
    add(check.images_[n], reach);
  }
  if (weights < least_points) {
    return false;
  }
  if (!with_clock || speeds < least_speed * weights) {
    H.row(num_unknowns - 1).setZero();
    H.col(num_unknowns - 1).setZero();
    g[num_unknowns - 1] = 0.0;
    H(num_unknowns - 1, num_unknowns - 1) = 1.0;
  }
  // What the images do not say stays as it was told.
  const Eigen::Isometry3d away = check.camera_.pose.inverse() * X;
  const Eigen::AngleAxisd turned(away.linear());
  H.diagonal().array() += told_weight * weights;
  g.head<3>() += told_weight * weights * turned.angle() * turned.axis();
  g.segment<3>(3) += told_weight * weights * (away.linear().transpose() * away.translation());
  const Unknowns change = -H.ldlt().solve(g);
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.linear() = rotation_by(change.head<3>());
  moved.translation() = change.segment<3>(3);
  X = X * moved;
  offset = std::clamp(offset + change[num_unknowns - 1], -longest_offset, longest_offset);
  return true;
}

CameraCheck::CameraCheck(const Arm& arm, const DepthCamera& camera)
    : arm_(arm), camera_(camera), rays_(camera), image_(camera) {
  camera_.validate();
  if (!camera_.link.empty()) {
    arm_.robot().frame_index(camera_.link);  // throws
  }
}

void CameraCheck::add_state(double time, const Eigen::VectorXd& q) {
  if (q.size() != arm_.num_coordinates() || !q.allFinite()) {
    throw std::invalid_argument("camera check: q has " + std::to_string(q.size()) +
                                " entries, allowed: " + std::to_string(arm_.num_coordinates()) + ", all finite");
  }
  if (!std::isfinite(time) || (!times_.empty() && time <= times_.back())) {
    throw std::invalid_argument("camera check: a state is of " + std::to_string(time) +
                                " s, allowed: later than the one before");
  }
  times_.push_back(time);
  states_.push_back(q);
}

void CameraCheck::add(const RawDepth& depth, double time) {
  if (!std::isfinite(time)) {
    throw std::invalid_argument("camera check: time of an image is " + std::to_string(time) +
                                ", allowed: seconds on the clock of the states");
  }
  image_.take(camera_, depth);
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < image_.size(); ++i) {
    if (image_.labels()[i] == PixelLabel::obstacle) {
      chosen.push_back(i);
    }
  }
  // Those far from the arm are taken out in `solve`, where the arm is known; a fixed share of all keeps their places apart.
  constexpr std::size_t most_of_image = 40 * points_of_image;
  const std::size_t every = std::max<std::size_t>(1, chosen.size() / most_of_image);
  Image image{time, Eigen::Matrix3Xd(3, static_cast<Eigen::Index>((chosen.size() + every - 1) / every))};
  for (std::size_t n = 0, k = 0; n < chosen.size(); n += every, ++k) {
    const std::size_t i = chosen[n];
    const double z = static_cast<double>(image_.depth()[i]);
    image.points.col(static_cast<Eigen::Index>(k)) << static_cast<double>(rays_.x()[i]) * z,
        static_cast<double>(rays_.y()[i]) * z, z;
  }
  images_.push_back(std::move(image));
}

bool CameraCheck::state_at(double time, Eigen::VectorXd& q) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), time);
  if (after == times_.begin() || after == times_.end()) {
    return false;
  }
  const auto n = static_cast<std::size_t>(after - times_.begin());
  q = states_[n - 1] + (time - times_[n - 1]) / (times_[n] - times_[n - 1]) * (states_[n] - states_[n - 1]);
  return true;
}

CameraCheck CameraCheck::near_arm() const {
  CameraCheck near = *this;
  Fit place(*this);
  Eigen::VectorXd q(arm_.num_coordinates());
  near.images_.clear();
  for (const Image& image : images_) {
    if (!state_at(image.time, q)) {
      continue;
    }
    place.now.update(arm_.robot(), q, Eigen::VectorXd::Zero(q.size()));
    const Eigen::Isometry3d X_WC = place.X_WC_at();
    std::vector<Eigen::Index> chosen;
    for (Eigen::Index n = 0; n < image.points.cols(); ++n) {
      if (std::abs(place.nearest(X_WC * image.points.col(n), first_reach).distance) < first_reach) {
        chosen.push_back(n);
      }
    }
    const auto every = std::max<std::size_t>(1, chosen.size() / points_of_image);
    Image kept{image.time, Eigen::Matrix3Xd(3, static_cast<Eigen::Index>((chosen.size() + every - 1) / every))};
    for (std::size_t n = 0, k = 0; n < chosen.size(); n += every, ++k) {
      kept.points.col(static_cast<Eigen::Index>(k)) = image.points.col(chosen[n]);
    }
    near.images_.push_back(std::move(kept));
  }
  return near;
}

CameraCorrection CameraCheck::solve() const {
  const CameraCheck near = near_arm();
  CameraCorrection result;
  for (const Image& image : near.images_) {
    result.images += image.points.cols() > 0 ? 1 : 0;
    result.points += static_cast<int>(image.points.cols());
  }
  if (result.images < least_images) {
    throw std::runtime_error(
        "camera check: " + std::to_string(result.images) +
        " images show the arm within 12 cm of where it should be, at least 3 are needed; check pose, unit of depth and joint states");
  }
  const auto fitted = [&](int first, int stride) {
    Fit fit(near);
    for (int round = 0; round < rounds; ++round) {
      const double reach = std::max(last_reach, first_reach * std::pow(reach_share, round));
      if (!fit.step(first, stride, reach, true)) {
        throw std::runtime_error(
            "camera check: too few points of the images are near the arm; check pose, unit of depth and joint states");
      }
    }
    return fit;
  };
  Fit before(near);
  before.step(0, 1, 2.0 * last_reach, false);
  result.rms_before = std::sqrt(before.squares / std::max(1.0, before.weights));
  const Fit all = fitted(0, 1);
  const Eigen::Isometry3d change = camera_.pose.inverse() * all.X;
  result.pose = all.X;
  result.translation = change.translation().norm();
  result.rotation = Eigen::AngleAxisd(change.linear()).angle();
  result.rms_after = std::sqrt(all.squares / all.weights);
  result.overshoot = all.overshoots / all.weights;
  const bool moves = all.speeds >= least_speed * all.weights;
  result.clock_offset = moves ? all.offset : std::numeric_limits<double>::quiet_NaN();
  if (near.images_.size() >= 2 * least_images) {
    const Fit even = fitted(0, 2), odd = fitted(1, 2);
    const Eigen::Isometry3d between = even.X.inverse() * odd.X;
    result.translation_spread = 0.5 * between.translation().norm();
    result.rotation_spread = 0.5 * Eigen::AngleAxisd(between.linear()).angle();
    result.clock_spread = 0.5 * std::abs(even.offset - odd.offset);
  }
  if (!moves) {
    result.question =
        "the arm hardly moves in these images, so they say nothing of the clock; and a pose of one posture may be wrong elsewhere";
  } else if (std::abs(all.offset) >= longest_offset) {
    result.question =
        "the clock offset is at least 0.3 s: images and states are not of the same motion, or of different clocks";
  } else if (result.rms_after > 0.015) {
    result.question = "points are far from the arm even so: the arm in view is another one, or something hides it";
  }
  return result;
}

}  // namespace sidestep
