#include "sidestep/arm/attachment.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <stdexcept>
#include <utility>

#include "../math/settings.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep {
namespace {

constexpr double solid_level = 5.0;  // Level yᵀ Σ⁻¹ y on the boundary of a solid ellipsoid of covariance Σ.
constexpr double thinnest = 1e-6;    // Smallest semi-axis of a cover [m].
// Distance of an object from its holder above which the pose is doubted, in sizes of the holder: a gripper that the arm
// lacks may be in between.
constexpr double far_sizes = 2.5;
// Bounds of that size [m]: flanges without a gripper are smaller, long links say nothing of what a hand holds.
constexpr double least_size = 0.12, most_size = 0.16;
// Distance from the holder above which the pose is doubted [m], if read in the world's frame it is within `at_hand` [m].
constexpr double apart = 0.15, at_hand = 0.05;

[[noreturn]] void refuse(const Attachment& object, const std::string& why) {
  throw std::invalid_argument("attach '" + object.name + "': " + why);
}

Body with_cover(const Arm& arm, const Attachment& object) {
  const Body& body = arm.body();
  const int before = body.num_components(), more = object.cover.size();
  std::vector<std::string> links = body.links;
  std::vector<Eigen::Matrix3d> covariances = body.covariances;
  Eigen::VectorXd weights(before + more), levels(before + more);
  Eigen::Matrix3Xd means(3, before + more);
  weights.head(before) = body.weights;
  levels.head(before) = body.levels;
  means.leftCols(before) = body.means;
  double volume = 0.0;
  for (int k = 0; k < more; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Eigen::Matrix3d& shape = object.cover.shapes[i];
    if (!shape.allFinite() || !object.cover.centres[i].allFinite() ||
        !(Eigen::JacobiSVD<Eigen::Matrix3d>(shape).singularValues()[2] > thinnest)) {
      refuse(object, "ellipsoid " + std::to_string(k) + " must be finite, with semi-axes longer than " +
                         std::to_string(thinnest) + " m");
    }
    links.push_back(object.name);
    covariances.push_back(shape * shape.transpose() / solid_level);
    means.col(before + k) = object.cover.centres[i];
    weights[before + k] = std::abs(shape.determinant());
    volume += weights[before + k];
  }
  weights.tail(more) /= volume;
  levels.tail(more).setConstant(solid_level);
  return Body(std::move(links), std::move(weights), std::move(means), std::move(covariances), std::move(levels));
}

Inertial joined(const Inertial& a, const Inertial& b) {
  const double mass = a.mass + b.mass;
  if (!(mass > 0.0)) {
    return a;
  }
  Inertial both{mass, (a.mass * a.com + b.mass * b.com) / mass, a.inertia + b.inertia};
  for (const Inertial* part : {&a, &b}) {
    const Eigen::Vector3d d = part->com - both.com;
    both.inertia += part->mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
  return both;
}

/// An ellipsoid {centre + S^½ u : |u| <= 1}.
struct Ellipsoid {
  Eigen::Vector3d centre;
  Eigen::Matrix3d S;
};

double gap_of(const std::vector<Ellipsoid>& one, const std::vector<Ellipsoid>& other) {
  double least = infinity;
  for (const Ellipsoid& a : one) {
    for (const Ellipsoid& b : other) {
      least = std::min(least, ellipsoid_gap(b.centre - a.centre, a.S, b.S).value);
    }
  }
  return least;
}

/// The ellipsoids of an object, in the frame that X takes its own frame to.
std::vector<Ellipsoid> placed(const Attachment& object, const Eigen::Isometry3d& X) {
  std::vector<Ellipsoid> all;
  for (std::size_t k = 0; k < object.cover.centres.size(); ++k) {
    const Eigen::Matrix3d shape = X.linear() * object.cover.shapes[k];
    all.push_back({X * object.cover.centres[k], shape * shape.transpose()});
  }
  return all;
}

/// Throws std::invalid_argument unless the object can be attached to the arm, at q if that is not empty.
void check_attachable(const Arm& arm, const Attachment& object, const Eigen::VectorXd& q) {
  const Robot& robot = arm.robot();
  if (object.name.empty()) {
    refuse(object, "the name is empty");
  }
  if (std::any_of(robot.frames().begin(), robot.frames().end(), [&](const Frame& f) { return f.name == object.name; })) {
    refuse(object, "the arm has a frame of this name; detach it first, or take another name");
  }
  const Frame& link = robot.frames()[static_cast<std::size_t>(robot.frame_index(object.link))];
  if (link.joint < 0) {
    refuse(object, "no joint moves link '" + object.link + "'");
  }
  const Eigen::Matrix3d R = object.X_LA.linear();
  if (!object.X_LA.matrix().allFinite() || !(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-6) ||
      R.determinant() < 0.0) {
    refuse(object, "the pose must be finite, a rotation and a position");
  }
  if (object.cover.size() == 0) {
    refuse(object, "it has no ellipsoid: nothing would keep it off obstacles");
  }
  if (q.size() != 0 && (q.size() != robot.num_coordinates() || !q.allFinite())) {
    refuse(object, "q has " + std::to_string(q.size()) + " entries, needed are " + std::to_string(robot.num_coordinates()) +
                       " finite ones");
  }
  object.inertial.validate("attach '" + object.name + "'");
  for (const std::string& name : object.may_touch) {
    robot.frame_index(name);
  }
}

/// Lets pairs of an attached object that are near each other at q be as near as there.
void let_near_pairs_be(std::vector<LinkPair>& own, const Robot& larger, const Body& body, const Eigen::VectorXd& q) {
  const ClearanceQuery clearance(larger, body, own);
  ClearanceQuery::Workspace w(clearance);
  Eigen::VectorXd gaps(clearance.num_items());
  clearance.clearances(q, Obstacles::none(), attached_distance, w, gaps);
  for (std::size_t k = 0; k < own.size(); ++k) {
    const auto item = clearance.num_items() - static_cast<Eigen::Index>(own.size()) + static_cast<Eigen::Index>(k);
    own[k].contact = std::min(0.0, gaps[item] - attached_distance);
  }
}

}  // namespace

std::string doubt(const Arm& holding, const Attachment& object, const Eigen::VectorXd& q) {
  const Robot& robot = holding.robot();
  const Body& body = holding.body();
  const Frame& link = robot.frames()[static_cast<std::size_t>(robot.frame_index(object.link))];
  std::vector<Ellipsoid> holder;  // Ellipsoids of the holder, in the frame of the joint that moves it.
  Eigen::Vector3d low = Eigen::Vector3d::Constant(infinity), high = -low;
  for (int k = 0; k < body.num_components(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Frame& frame = robot.frames()[static_cast<std::size_t>(robot.frame_index(body.links[i]))];
    if (frame.joint == link.joint && frame.name != object.name) {
      const Eigen::Matrix3d S = body.levels[k] * frame.X_JF.linear() * body.covariances[i] * frame.X_JF.linear().transpose();
      const Eigen::Vector3d centre = frame.X_JF * body.means.col(k), reach = S.diagonal().cwiseSqrt();
      holder.push_back({centre, S});
      low = low.cwiseMin(centre - reach);
      high = high.cwiseMax(centre + reach);
    }
  }
  if (holder.empty()) {
    return {};
  }
  const double gap = gap_of(holder, placed(object, link.X_JF * object.X_LA));
  double in_world = infinity;
  if (q.size() != 0) {
    KinematicState state(robot);
    state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
    Eigen::Isometry3d X_WJ = Eigen::Isometry3d::Identity();
    X_WJ.linear() = state.link(link.joint).R_WL;
    X_WJ.translation() = state.link(link.joint).p_WL;
    in_world = gap_of(holder, placed(object, X_WJ.inverse() * object.X_LA));
  }
  const bool is_of_world = gap > apart && in_world < at_hand;
  if (!is_of_world && !(gap > far_sizes * std::clamp((high - low).maxCoeff(), least_size, most_size))) {
    return {};
  }
  char away[32];
  std::snprintf(away, sizeof away, "%.2f m", gap);
  return "attach '" + object.name + "': it is " + away + " away from link '" + object.link +
         "' that holds it; pose is that of its frame in the frame of the link" +
         (is_of_world ? ", and looks like one in the world: give inverse(pose of the link in the world) @ pose"
                      : "; is it one in the world?");
}

Arm attach(const Arm& arm, const Attachment& object, const Eigen::VectorXd& q) {
  check_attachable(arm, object, q);
  const Robot& robot = arm.robot();
  const Frame& link = robot.frames()[static_cast<std::size_t>(robot.frame_index(object.link))];
  const Frame frame{object.name, link.joint, link.X_JF * object.X_LA};
  std::vector<Frame> frames = robot.frames();
  frames.push_back(frame);
  Robot larger(robot.name(), robot.joints(), std::move(frames), robot.coordinate_names(), robot.limits());
  Body body = with_cover(arm, object);

  std::vector<LinkPair> pairs = arm.pairs(), own;
  ArmDetails details{arm.proof(), arm.allowed_pairs(), arm.provenance()};
  const std::set<std::string> covered(arm.body().links.begin(), arm.body().links.end());
  for (const std::string& other : covered) {
    if (robot.frames()[static_cast<std::size_t>(robot.frame_index(other))].joint == frame.joint) {
      continue;
    }
    if (std::find(object.may_touch.begin(), object.may_touch.end(), other) != object.may_touch.end()) {
      details.allowed_pairs.emplace_back(object.name, other);
    } else {
      own.push_back({object.name, other, 0.0});
    }
  }
  if (q.size() != 0 && !own.empty()) {
    let_near_pairs_be(own, larger, body, q);
  }
  pairs.insert(pairs.end(), own.begin(), own.end());

  std::vector<Inertial> inertials = arm.inertials();
  if (!inertials.empty()) {
    Inertial placed = object.inertial;
    const Eigen::Matrix3d R_JA = frame.X_JF.linear();
    placed.com = frame.X_JF * object.inertial.com;
    placed.inertia = R_JA * object.inertial.inertia * R_JA.transpose();
    Inertial& holder = inertials[static_cast<std::size_t>(frame.joint)];
    holder = joined(holder, placed);
  }
  return Arm(std::move(larger), std::move(body), std::move(pairs), arm.tables(), std::move(inertials), std::move(details));
}

}  // namespace sidestep
