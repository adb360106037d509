#include "sidestep/clearance/clearance_query.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {

ClearanceQuery::ClearanceQuery(std::shared_ptr<const ClearanceItems> items) : items_(std::move(items)) {
  for (const Joint& joint : robot().joints()) {
    const Eigen::Vector3d& a = joint.axis;
    const Eigen::Matrix3d R_PJ = joint.X_PJ.linear();
    Eigen::Matrix3d cross;
    cross << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    rotations_.push_back({R_PJ * a * a.transpose(), R_PJ - R_PJ * a * a.transpose(), R_PJ * cross});
  }
}

ClearanceQuery::Workspace::Workspace(const ClearanceQuery& body)
    : poses_(body.robot().joints().size()),
      centres_(static_cast<std::size_t>(body.items().links().size())),
      motions_(body.num_items()),
      curvatures_(body.num_items()),
      lengths_(body.robot().num_coordinates()),
      products_(body.robot().num_coordinates() * body.robot().num_coordinates()),
      q_(body.robot().num_coordinates()),
      difference_(body.robot().num_coordinates()),
      placed_(body.robot().num_coordinates()),
      state_(body.robot()),
      rest_(Eigen::VectorXd::Zero(body.robot().num_coordinates())),
      gradient_(rest_) {
  std::size_t most = 0;
  for (int i = 0; i < body.items().links().size(); ++i) {
    most = std::max(most, body.items().links()[i].ellipsoids.size());
  }
  bounds_.resize(most);
  intervals_.reserve(most_intervals);
  open_.resize(most_intervals * body.words());
}

void ClearanceQuery::place(ConstVectorRef q, Workspace& w) const noexcept {
  w.placed_ = q;
  w.state_is_old_ = true;
  for (std::size_t i = 0; i < rotations_.size(); ++i) {
    const Joint& joint = robot().joints()[i];
    const Workspace::Pose& parent = pose(w, joint.parent);
    Workspace::Pose& child = w.poses_[i];
    const double position = joint.multiplier * q[joint.coordinate] + joint.offset;
    child.p = parent.p + parent.R * joint.X_PJ.translation();
    if (joint.type == JointType::revolute) {
      const Rotation& rotation = rotations_[i];
      const Eigen::Matrix3d R_PL = rotation.fixed + std::cos(position) * rotation.cosine + std::sin(position) * rotation.sine;
      child.R = parent.R.lazyProduct(R_PL);
    } else {
      child.R = parent.R.lazyProduct(joint.X_PJ.linear());
      child.p += position * (child.R * joint.axis);
    }
  }
  const BodyLinks& links = items_->links();
  for (int i = 0; i < links.size(); ++i) {
    const Workspace::Pose& X = pose(w, links[i].joint);
    w.centres_[static_cast<std::size_t>(i)] = X.p + X.R * links[i].centre;
  }
}

const KinematicState& ClearanceQuery::state(Workspace& w) const noexcept {
  if (std::exchange(w.state_is_old_, false)) {
    w.state_.update(robot(), w.placed_, w.rest_);
  }
  return w.state_;
}

const ClearanceQuery::Workspace::Pose& ClearanceQuery::pose(const Workspace& w, int joint) const noexcept {
  static const Workspace::Pose world{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                     Eigen::Vector3d::Zero()};
  return joint < 0 ? world : w.poses_[static_cast<std::size_t>(joint)];
}

ClearanceQuery::Nearest ClearanceQuery::nearest_of(int begin, int end, ConstVectorRef q, const Obstacles& obstacles, double cap,
                                                   Workspace& w) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  Nearest nearest{cap};
  for (int i = begin; i < end; ++i) {
    const Found found = measure((*items_)[i], obstacles, {nearest.clearance, infinity, -infinity}, w);
    if (found.clearance < nearest.clearance) {
      nearest = {found.clearance, i, found.point};
    }
  }
  return nearest;
}

double ClearanceQuery::nearest_moving(ConstVectorRef q, const Obstacles& obstacles, double time, Workspace& w) const noexcept {
  double nearest = infinity;
  if (!obstacles.tree().moves()) {
    return nearest;
  }
  place(q, w);
  for (const Eigen::Index n : obstacles.movers()) {
    const double speed = obstacles.velocities().col(n).norm();
    for (int i = 0; speed > 0.0 && i < items_->num_obstacles(); ++i) {
      const int link = (*items_)[i].link;
      const double away = (obstacles.points().col(n) - w.centres_[static_cast<std::size_t>(link)]).norm();
      nearest = std::min(nearest, away - items_->links()[link].radius - obstacles.radii()[n] - time * speed);
    }
  }
  return nearest;
}

void ClearanceQuery::clearances(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w,
                                Eigen::Ref<Eigen::VectorXd> out) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  for (int i = 0; i < num_items(); ++i) {
    out[i] = measure((*items_)[i], obstacles, {cap, infinity, -infinity}, w).clearance;
  }
}

double ClearanceQuery::distance_left(ConstVectorRef q, const Obstacles& obstacles, const Eigen::VectorXd& floors, double near,
                                     double cap, Workspace& w) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  double least = cap;
  const int first = w.last_;  // what had the least before
  for (int k = 0; k < num_items() && least >= 0.0; ++k) {
    const int i = k == 0 ? first : k <= first ? k - 1 : k;
    const ClearanceItem& item = (*items_)[i];
    if (item.source == ClearanceItem::Source::load) {
      continue;
    }
    const double found = measure(item, obstacles, {least + floors[i], near + floors[i], floors[i]}, w).clearance - floors[i];
    if (found < least) {
      least = found;
      w.last_ = i;
    }
  }
  return least;
}

}  // namespace sidestep
