#include "sidestep/clearance/body_clearance.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "../math/settings.hpp"
#include "kernels/distance_kernel.hpp"
#include "sidestep/attractor/clearance_table_barrier.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"
#include "sidestep/attractor/self_collision_barrier.hpp"

namespace sidestep {
namespace {

constexpr const char* owner = "body clearance";
constexpr double closest_centres = 1e-6;                        // [m] of which a direction is taken
constexpr BarrierFunction any_barrier{0.05, 0.02, 2.0, 0.002};  // that is longer than of links that are usually near
constexpr int planes_of_pair = 3;                               // tried before the gap of two ellipsoids is looked for

static_assert(kernels::most_balls == PointTree::leaf_size);

kernels::PlacedEllipsoid placed(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes, const Eigen::Vector3d& squares,
                                double extent) noexcept {
  kernels::PlacedEllipsoid ellipsoid;
  ellipsoid.extent = extent;
  Eigen::Map<Eigen::Vector3d>(ellipsoid.centre) = centre;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(ellipsoid.axes) = axes;
  Eigen::Map<Eigen::Vector3d>(ellipsoid.squares) = squares;
  return ellipsoid;
}

}  // namespace

BodyClearance::BodyClearance(Robot robot, const Body& body, const std::vector<LinkPair>& pairs,
                             const std::vector<KeptPlane>& planes, std::vector<ClearanceTable> tables,
                             std::optional<HoldingTorque> holding)
    : robot_(std::move(robot)), tables_(std::move(tables)), holding_(std::move(holding)) {
  for (const Joint& joint : robot_.joints()) {
    const Eigen::Vector3d& a = joint.axis;
    const Eigen::Matrix3d R_PJ = joint.X_PJ.linear();
    Eigen::Matrix3d cross;
    cross << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    rotations_.push_back({R_PJ * a * a.transpose(), R_PJ - R_PJ * a * a.transpose(), R_PJ * cross});
  }
  const std::vector<BodyEllipsoid> all = body_ellipsoids(robot_, body, owner);
  const auto nv = robot_.num_coordinates();
  const auto item = [nv](CoordinateLabel label, int link) { return Item(std::move(label), link, nv); };
  // The links far from the base first: they are the likeliest in the way.
  for (auto e = all.rbegin(); e != all.rend(); ++e) {
    const std::string& name = body.links[static_cast<std::size_t>(e->component)];
    const auto same = [&](const Link& link) { return link.name == name; };
    if (e->joint >= 0 && std::none_of(links_.begin(), links_.end(), same)) {
      items_.push_back(item({CoordinateLabel::Kind::obstacle, name}, add_link(all, body, name)));
      add_reach(items_.back(), links_.back());
    }
  }
  if (items_.empty()) {
    throw std::invalid_argument(std::string(owner) + ": no ellipsoid of the body lies on a link that a joint of robot '" +
                                robot_.name() + "' moves");
  }
  for (const auto& [a, b, contact] : pairs) {
    items_.push_back(item({CoordinateLabel::Kind::self, a, b}, add_link(all, body, a)));
    Item& pair = items_.back();
    pair.contact = contact;
    pair.other = add_link(all, body, b);
    const Link &first = links_[static_cast<std::size_t>(pair.link)], &second = links_[static_cast<std::size_t>(pair.other)];
    if (first.joint == second.joint) {
      throw std::invalid_argument(std::string(owner) + ": links '" + a + "' and '" + b + "' are rigidly connected");
    }
    // The joints above both move both alike. Parents have smaller indices.
    int i = first.joint, j = second.joint;
    while (i != j) {
      int& later = i > j ? i : j;
      later = robot_.joints()[static_cast<std::size_t>(later)].parent;
    }
    pair.base = i;
    add_reach(pair, first);
    add_reach(pair, second);
  }
  for (const KeptPlane& plane : planes) {
    if (!plane.point.allFinite() || !plane.normal.allFinite() || !(plane.normal.norm() > 0.0)) {
      throw std::invalid_argument(std::string(owner) + ": point and normal of a plane must be finite, and normal not zero");
    }
    const Eigen::Vector3d normal = plane.normal.normalized();
    planes_.push_back({normal, normal.dot(plane.point)});
    for (const std::string& name : plane.links) {
      items_.push_back(item({CoordinateLabel::Kind::plane, name}, add_link(all, body, name)));
      items_.back().plane = static_cast<int>(planes_.size()) - 1;
      add_reach(items_.back(), links_[static_cast<std::size_t>(items_.back().link)]);
    }
  }
  add_tables();
  const auto bound_margins = [](const Barrier& barrier, auto item) {
    for (const double activation : barrier.activations()) {
      (item++)->most_margin = Barrier::margin_share * activation;
    }
  };
  const auto first_pair = std::find_if(items_.begin(), items_.end(), [](const Item& i) { return i.other >= 0; });
  if (!pairs.empty()) {
    bound_margins(SelfCollisionBarrier(robot_, body, pairs, any_barrier), first_pair);
  }
  if (!tables_.empty()) {
    bound_margins(ClearanceTableBarrier(robot_, tables_, any_barrier),
                  items_.end() - static_cast<std::ptrdiff_t>(tables_.size()));
  }
  add_loads();
  reach_ = Eigen::VectorXd::Zero(nv);
  reaches_.resize(num_items(), nv);
  bends_.resize(num_items(), nv * nv);
  for (Eigen::Index k = 0; const Item& i : items_) {
    reaches_.row(k) = i.reach.transpose();
    bends_.row(k++) = i.bend.transpose().reshaped().transpose();
    if (!i.reach.allFinite()) {
      throw std::invalid_argument(std::string(owner) + ": a prismatic joint above link '" + i.label.name +
                                  "' has no position limits, so that no edge could be proven free");
    }
    reach_ = reach_.cwiseMax(i.reach);
  }
}

BodyClearance::Workspace::Workspace(const BodyClearance& body)
    : poses_(body.robot_.joints().size()),
      centres_(body.links_.size()),
      motions_(body.num_items()),
      curvatures_(body.num_items()),
      lengths_(body.robot_.num_coordinates()),
      products_(body.robot_.num_coordinates() * body.robot_.num_coordinates()),
      q_(body.robot_.num_coordinates()),
      difference_(body.robot_.num_coordinates()),
      placed_(body.robot_.num_coordinates()),
      state_(body.robot_),
      rest_(Eigen::VectorXd::Zero(body.robot_.num_coordinates())),
      gradient_(rest_) {
  std::size_t most = 0;
  for (const Link& link : body.links_) {
    most = std::max(most, link.ellipsoids.size());
  }
  bounds_.resize(most);
  intervals_.reserve(most_intervals);
  open_.resize(most_intervals * body.words());
}

void BodyClearance::place(ConstVectorRef q, Workspace& w) const noexcept {
  w.placed_ = q;
  w.state_is_old_ = true;
  for (std::size_t i = 0; i < rotations_.size(); ++i) {
    const Joint& joint = robot_.joints()[i];
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
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Workspace::Pose& X = pose(w, links_[i].joint);
    w.centres_[i] = X.p + X.R * links_[i].centre;
  }
}

const KinematicState& BodyClearance::state(Workspace& w) const noexcept {
  if (std::exchange(w.state_is_old_, false)) {
    w.state_.update(robot_, w.placed_, w.rest_);
  }
  return w.state_;
}

const BodyClearance::Workspace::Pose& BodyClearance::pose(const Workspace& w, int joint) const noexcept {
  static const Workspace::Pose world{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                     Eigen::Vector3d::Zero()};
  return joint < 0 ? world : w.poses_[static_cast<std::size_t>(joint)];
}

BodyClearance::Found BodyClearance::look(const Item& item, const Obstacles& obstacles, const Asked& asked,
                                         Workspace& w) const noexcept {
  ++w.checks_;
  if (item.other >= 0) {
    const Asked gap_asked{asked.cap + item.contact, asked.near + item.contact, asked.stop + item.contact};
    const double gap = look_at_pair(item, gap_asked, w);
    return {gap < gap_asked.cap ? gap - item.contact : asked.cap, -1};  // exactly the cap where nothing is nearer
  }
  if (item.table >= 0) {
    const ClearanceTable& table = tables_[static_cast<std::size_t>(item.table)];
    const double clearance = table.at(w.placed_[table.axes[0].coordinate], w.placed_[table.axes[1].coordinate]).value;
    return {std::min(clearance, asked.cap), -1};
  }
  if (item.load >= 0) {
    return {std::min(holding_->value(holding_->loads()[static_cast<std::size_t>(item.load)], state(w)), asked.cap), -1};
  }
  if (item.plane >= 0) {
    const Link& link = links_[static_cast<std::size_t>(item.link)];
    return {look_at_plane(link, planes_[static_cast<std::size_t>(item.plane)], asked.cap, w), -1};
  }
  return look_at_points(item, obstacles, asked, w);
}

BodyClearance::Found BodyClearance::look_at_points(const Item& item, const Obstacles& obstacles, const Asked& asked,
                                                   Workspace& w) const noexcept {
  const Link& link = links_[static_cast<std::size_t>(item.link)];
  const Workspace::Pose& X = pose(w, link.joint);
  const auto bound = [&](const Eigen::Vector3d& place, double radius, double enough) {
    return w.field_.bound(place, enough + radius, obstacles) - radius;
  };
  Found found{asked.cap, -1};
  // From coarse to fine: the ball around the link, those around its ellipsoids, those that cover them, and themselves.
  const double around = bound(w.centres_[static_cast<std::size_t>(item.link)], link.radius, asked.cap);
  if (around >= std::min(asked.cap, asked.near)) {
    found.clearance = std::min(asked.cap, around);
    return found;
  }
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < link.ellipsoids.size(); ++i) {
    const Ellipsoid& e = link.ellipsoids[i];
    double least = bound(X.p + X.R * e.mean, e.extent, found.clearance);
    if (least < std::min(asked.near, found.clearance)) {
      double covered = infinity;
      for (const CoverBall& ball : e.cover) {
        covered = std::min(covered, bound(X.p + X.R * ball.centre, ball.radius, found.clearance));
        if (covered <= std::max(least, 0.0)) {
          break;  // they say no more
        }
      }
      if (covered > 0.0) {  // nothing is in them; of depths they say nothing
        least = std::max(least, covered);
      }
    }
    w.bounds_[i] = least;
    nearest = least < w.bounds_[nearest] ? i : nearest;
    if (least >= asked.near) {
      found.clearance = std::min(found.clearance, least);
    }
  }
  const PointTree& tree = obstacles.tree();
  const kernels::Distances distances = kernels::distances();
  // The one that seems nearest first: those whose bound is above its clearance need not be looked at.
  for (std::size_t k = 0; k < link.ellipsoids.size() && !(found.clearance < asked.stop); ++k) {
    const std::size_t i = k == 0 ? nearest : (k <= nearest ? k - 1 : k);
    if (!(w.bounds_[i] < std::min(asked.near, found.clearance))) {
      continue;
    }
    const Ellipsoid& e = link.ellipsoids[i];
    const kernels::PlacedEllipsoid ellipsoid = placed(X.p + X.R * e.mean, e.axes_T * X.R.transpose(), e.squares, e.extent);
    const auto measure = [&](const auto& nodes, int first, int count, double least, float* values) {
      return distances(ellipsoid, nodes, first, count, least, values);
    };
    const PointTree::Nearest at = tree.nearest(found.clearance, asked.stop, measure);
    if (at.point >= 0) {
      found = {at.distance, tree.order()[static_cast<std::size_t>(at.point)]};
    }
  }
  return found;
}

double BodyClearance::look_at_pair(const Item& item, const Asked& asked, const Workspace& w) const noexcept {
  const auto first = static_cast<std::size_t>(item.link), second = static_cast<std::size_t>(item.other);
  const Link &a = links_[first], &b = links_[second];
  double least = asked.cap;
  const double far = a.radius + b.radius + asked.cap;
  const double squared = (w.centres_[second] - w.centres_[first]).squaredNorm();
  if (far <= 0.0 || squared >= far * far) {
    return least;
  }
  if (const double around = std::sqrt(squared) - a.radius - b.radius; around >= asked.near) {
    return around;
  }
  const Workspace::Pose &X = pose(w, a.joint), &Y = pose(w, b.joint);
  // In the frame of a's joint, where the centres of a stand still.
  const Eigen::Matrix3d R_XY = X.R.transpose() * Y.R;
  const Eigen::Vector3d p_XY = X.R.transpose() * (Y.p - X.p);
  for (const Ellipsoid& f : b.ellipsoids) {
    const Eigen::Vector3d centre = p_XY + R_XY * f.mean;
    const double reach = f.extent + a.radius + least;
    if (reach <= 0.0 || (centre - a.centre).squaredNorm() >= reach * reach) {
      continue;
    }
    for (const Ellipsoid& e : a.ellipsoids) {
      const Eigen::Vector3d d = centre - e.mean;
      const double cut = e.extent + f.extent + least;
      const double distance = d.squaredNorm();
      if (cut <= 0.0 || distance >= cut * cut) {
        continue;
      }
      const bool apart = distance > closest_centres * closest_centres;
      Eigen::Vector3d n = apart ? Eigen::Vector3d(d / std::sqrt(distance)) : Eigen::Vector3d::UnitX().eval();
      // A plane across n supports both; the next lies across what is between the places where it touches them.
      double bound = -infinity;
      for (int k = 0; k < planes_of_pair && bound < std::min(asked.near, least); ++k) {
        const Eigen::Vector3d on_a = e.shape * n, on_b = R_XY * (f.shape * (R_XY.transpose() * n));
        const double reach_a = std::sqrt(n.dot(on_a)), reach_b = std::sqrt(n.dot(on_b));
        bound = std::max(bound, n.dot(d) - reach_a - reach_b);
        n = (d - on_a / reach_a - on_b / reach_b).normalized();
      }
      if (bound < least) {
        const double gap = bound < asked.near ? ellipsoid_gap(d, e.shape, R_XY * f.shape * R_XY.transpose()).value : bound;
        least = std::min(least, gap);
        if (least < asked.stop) {
          return least;
        }
      }
    }
  }
  return least;
}

double BodyClearance::look_at_plane(const Link& link, const Plane& plane, double cap, const Workspace& w) const noexcept {
  const Workspace::Pose& X = pose(w, link.joint);
  double least = cap;
  if (plane.normal.dot(X.p + X.R * link.centre) - plane.offset - link.radius >= cap) {
    return least;
  }
  const Eigen::Vector3d n = X.R.transpose() * plane.normal;
  for (const Ellipsoid& e : link.ellipsoids) {
    const double height = plane.normal.dot(X.p) + n.dot(e.mean) - plane.offset;
    least = std::min(least, height - std::sqrt(n.dot(e.shape * n)));
  }
  return least;
}

BodyClearance::Nearest BodyClearance::nearest(ConstVectorRef q, const Obstacles& obstacles, double cap,
                                              Workspace& w) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  Nearest nearest{cap};
  for (int i = 0; i < num_items(); ++i) {
    const Found found = look(items_[static_cast<std::size_t>(i)], obstacles, {nearest.clearance, infinity, -infinity}, w);
    if (found.clearance < nearest.clearance) {
      nearest = {found.clearance, i, found.point};
    }
  }
  return nearest;
}

BodyClearance::Nearest BodyClearance::nearest(int item, ConstVectorRef q, const Obstacles& obstacles, double cap,
                                              Workspace& w) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  const Found found = look(items_[static_cast<std::size_t>(item)], obstacles, {cap, infinity, -infinity}, w);
  return {found.clearance, found.clearance < cap ? item : -1, found.point};
}

BodyClearance::Nearest BodyClearance::nearest_obstacle(ConstVectorRef q, const Obstacles& obstacles, double cap,
                                                       Workspace& w) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  Nearest nearest{cap};
  for (int i = 0; i < num_items() && label(i).kind == CoordinateLabel::Kind::obstacle; ++i) {  // they come first
    const Found found = look(items_[static_cast<std::size_t>(i)], obstacles, {nearest.clearance, infinity, -infinity}, w);
    if (found.clearance < nearest.clearance) {
      nearest = {found.clearance, i, found.point};
    }
  }
  return nearest;
}

double BodyClearance::nearest_moving(ConstVectorRef q, const Obstacles& obstacles, double time, Workspace& w) const noexcept {
  double nearest = infinity;
  if (!obstacles.tree().moves()) {
    return nearest;
  }
  place(q, w);
  for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
    const double speed = obstacles.velocities().col(n).norm();
    for (const Item& item : items_) {
      if (speed > 0.0 && item.label.kind == CoordinateLabel::Kind::obstacle) {
        const auto link = static_cast<std::size_t>(item.link);
        const double away = (obstacles.points().col(n) - w.centres_[link]).norm() - links_[link].radius;
        nearest = std::min(nearest, away - obstacles.radii()[n] - time * speed);
      }
    }
  }
  return nearest;
}

void BodyClearance::clearances(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w,
                               Eigen::Ref<Eigen::VectorXd> out) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  for (int i = 0; i < num_items(); ++i) {
    out[i] = look(items_[static_cast<std::size_t>(i)], obstacles, {cap, infinity, -infinity}, w).clearance;
  }
}

double BodyClearance::room(ConstVectorRef q, const Obstacles& obstacles, const Eigen::VectorXd& floors, double near, double cap,
                           Workspace& w) const noexcept {
  w.field_.follow(obstacles);
  place(q, w);
  double least = cap;
  const int first = w.last_;  // what had the least before
  for (int k = 0; k < num_items() && least >= 0.0; ++k) {
    const int i = k == 0 ? first : k <= first ? k - 1 : k;
    const Item& item = items_[static_cast<std::size_t>(i)];
    if (item.load >= 0) {
      continue;
    }
    const double found = look(item, obstacles, {least + floors[i], near + floors[i], floors[i]}, w).clearance - floors[i];
    if (found < least) {
      least = found;
      w.last_ = i;
    }
  }
  return least;
}

}  // namespace sidestep
