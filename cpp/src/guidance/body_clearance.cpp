#include "sidestep/guidance/body_clearance.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "kernels/distance_kernel.hpp"
#include "sidestep/embedding/instruction_set.hpp"
#include "sidestep/embedding/ellipsoid_gap.hpp"

namespace sidestep {
namespace {

constexpr const char* owner = "body clearance";
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t most_intervals = 4096;  // of an edge: 2 m of motion cut down to 1 mm
constexpr double closest_centres = 1e-6;      // [m] of which a direction is taken

static_assert(kernels::most_balls == PointTree::leaf_size);

kernels::Distances distances_kernel() noexcept {
#if defined(SIDESTEP_X86_KERNELS)
  switch (instruction_set()) {
    case InstructionSet::avx512: return kernels::distances_avx512;
    case InstructionSet::avx2: return kernels::distances_avx2;
    case InstructionSet::baseline: break;
  }
#endif
  return kernels::distances_baseline;
}

kernels::PlacedEllipsoid placed(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes, const Eigen::Vector3d& squares,
                                double extent) noexcept {
  kernels::PlacedEllipsoid ellipsoid;
  ellipsoid.extent = extent;
  Eigen::Map<Eigen::Vector3d>(ellipsoid.centre) = centre;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(ellipsoid.axes) = axes;
  Eigen::Map<Eigen::Vector3d>(ellipsoid.squares) = squares;
  return ellipsoid;
}

double across(const Eigen::Vector3d& offset, const Eigen::Vector3d& axis) { return offset.cross(axis).norm(); }

}  // namespace

BodyClearance::BodyClearance(Robot robot, const Body& body, const std::vector<LinkPair>& pairs,
                             const std::vector<KeptPlane>& planes)
    : robot_(std::move(robot)) {
  for (const Joint& joint : robot_.joints()) {
    const Eigen::Vector3d& a = joint.axis;
    const Eigen::Matrix3d R_PJ = joint.X_PJ.linear();
    Eigen::Matrix3d cross;
    cross << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    rotations_.push_back({R_PJ * a * a.transpose(), R_PJ - R_PJ * a * a.transpose(), R_PJ * cross});
  }
  const std::vector<BodyEllipsoid> all = body_ellipsoids(robot_, body, owner);
  const auto nv = robot_.num_coordinates();
  const auto item = [&](CoordinateLabel label, int link) {
    return Item{std::move(label), link, -1, -1, Eigen::VectorXd::Zero(nv), 0.0};
  };
  // The links far from the base first: they are the likeliest in the way.
  for (auto e = all.rbegin(); e != all.rend(); ++e) {
    const std::string& name = body.links[static_cast<std::size_t>(e->component)];
    const auto same = [&](const Link& link) { return link.name == name; };
    if (e->joint >= 0 && std::none_of(links_.begin(), links_.end(), same)) {
      items_.push_back(item({CoordinateLabel::Kind::obstacle, name}, add_link(all, body, name)));
      add_reach(items_.back().reach, links_.back(), -1);
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
    add_reach(pair.reach, first, i);
    add_reach(pair.reach, second, i);
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
      add_reach(items_.back().reach, links_[static_cast<std::size_t>(items_.back().link)], -1);
    }
  }
  if (num_items() > max_items) {
    throw std::invalid_argument(std::string(owner) + ": " + std::to_string(num_items()) +
                                " links, pairs and planes; at most " + std::to_string(max_items) + " are allowed");
  }
  reach_ = Eigen::VectorXd::Zero(nv);
  for (const Item& i : items_) {
    if (!i.reach.allFinite()) {
      throw std::invalid_argument(std::string(owner) + ": a prismatic joint above link '" + i.label.name +
                                  "' has no position limits, so that no edge could be proven free");
    }
    reach_ = reach_.cwiseMax(i.reach);
  }
}

int BodyClearance::add_link(const std::vector<BodyEllipsoid>& all, const Body& body, const std::string& name) {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].name == name) {
      return static_cast<int>(i);
    }
  }
  Link link{name, robot_.frames()[static_cast<std::size_t>(robot_.frame_index(name))].joint, {}, Eigen::Vector3d::Zero(), 0.0};
  for (const BodyEllipsoid& e : all) {
    if (body.links[static_cast<std::size_t>(e.component)] == name) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(e.shape);
      link.ellipsoids.push_back({e.mean, eigen.eigenvectors().transpose(), eigen.eigenvalues(), e.shape, e.extent});
      link.centre += e.mean;
    }
  }
  if (link.ellipsoids.empty()) {
    throw std::invalid_argument(std::string(owner) + ": the body has no ellipsoid on link '" + name + "'");
  }
  link.centre /= static_cast<double>(link.ellipsoids.size());
  for (const Ellipsoid& e : link.ellipsoids) {
    link.radius = std::max(link.radius, (e.mean - link.centre).norm() + e.extent);
  }
  links_.push_back(std::move(link));
  return static_cast<int>(links_.size()) - 1;
}

void BodyClearance::add_reach(Eigen::VectorXd& reach, const Link& link, int end) const {
  // Up the chain, with a ball around the origin below that holds the link in every configuration.
  double ball = 0.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // of that origin, from joint j
  for (int j = link.joint; j != end;) {
    const Joint& joint = robot_.joints()[static_cast<std::size_t>(j)];
    double radius = 0.0, next = 0.0;  // from the axis; of the ball around j
    if (j == link.joint) {
      for (const Ellipsoid& e : link.ellipsoids) {
        radius = std::max(radius, across(e.mean, joint.axis) + e.extent);
        next = std::max(next, e.mean.norm() + e.extent);
      }
    } else {
      radius = across(offset, joint.axis) + ball;
      next = offset.norm() + ball;
    }
    const bool turns = joint.type == JointType::revolute;
    reach[joint.coordinate] += std::abs(joint.multiplier) * (turns ? radius : 1.0);
    if (!turns) {
      const JointLimits& limits = robot_.limits();
      const double low = joint.multiplier * limits.lower[joint.coordinate] + joint.offset;
      const double high = joint.multiplier * limits.upper[joint.coordinate] + joint.offset;
      next += std::max(std::abs(low), std::abs(high));
    }
    ball = next;
    offset = joint.X_PJ.translation();
    j = joint.parent;
  }
}

BodyClearance::Workspace::Workspace(const BodyClearance& body)
    : poses_(body.robot_.joints().size()),
      motions_(body.items_.size()),
      q_(body.robot_.num_coordinates()),
      difference_(body.robot_.num_coordinates()) {
  intervals_.reserve(most_intervals);
}

void BodyClearance::place(Eigen::Ref<const Eigen::VectorXd> q, Workspace& w) const noexcept {
  for (std::size_t i = 0; i < rotations_.size(); ++i) {
    const Joint& joint = robot_.joints()[i];
    const Workspace::Pose& parent = pose(w, joint.parent);
    Workspace::Pose& child = w.poses_[i];
    const double position = joint.multiplier * q[joint.coordinate] + joint.offset;
    child.p = parent.p + parent.R * joint.X_PJ.translation();
    if (joint.type == JointType::revolute) {
      const Rotation& rotation = rotations_[i];
      const Eigen::Matrix3d R_PL =
          rotation.fixed + std::cos(position) * rotation.cosine + std::sin(position) * rotation.sine;
      child.R = parent.R.lazyProduct(R_PL);
    } else {
      child.R = parent.R.lazyProduct(joint.X_PJ.linear());
      child.p += position * (child.R * joint.axis);
    }
  }
}

const BodyClearance::Workspace::Pose& BodyClearance::pose(const Workspace& w, int joint) const noexcept {
  static const Workspace::Pose world{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  return joint < 0 ? world : w.poses_[static_cast<std::size_t>(joint)];
}

BodyClearance::Found BodyClearance::look(const Item& item, const Obstacles& obstacles, double cap, double stop,
                                         const Workspace& w) const noexcept {
  const Link& link = links_[static_cast<std::size_t>(item.link)];
  if (item.other >= 0) {
    const Link& other = links_[static_cast<std::size_t>(item.other)];
    const double gap_cap = cap + item.contact;
    const double gap = look_at_pair(link, other, gap_cap, stop + item.contact, w);
    return {gap < gap_cap ? gap - item.contact : cap, -1};  // exactly the cap where nothing is nearer
  }
  if (item.plane >= 0) {
    return {look_at_plane(link, planes_[static_cast<std::size_t>(item.plane)], cap, w), -1};
  }
  return look_at_points(link, obstacles, cap, stop, w);
}

BodyClearance::Found BodyClearance::look_at_points(const Link& link, const Obstacles& obstacles, double cap, double stop,
                                                   const Workspace& w) const noexcept {
  const Workspace::Pose& X = pose(w, link.joint);
  const PointTree& tree = obstacles.tree();
  const kernels::Distances distances = distances_kernel();
  Found found{cap, -1};
  // Whether anything is near the ball around the link.
  if (link.ellipsoids.size() > 1) {
    const Eigen::Vector3d centre = X.p + X.R * link.centre;
    const auto around = [&](const Balls& balls, int first, int count, double least, float* values) {
      unsigned near = 0;
      for (int i = 0; i < count; ++i) {
        const int n = first + i;
        const double x = balls.x[n] - centre.x(), y = balls.y[n] - centre.y(), z = balls.z[n] - centre.z();
        const double distance = std::sqrt(x * x + y * y + z * z) - balls.radius[n];
        values[i] = static_cast<float>(distance);
        near |= (distance < least ? 1u : 0u) << i;
      }
      return near;
    };
    const double reach = link.radius + cap;
    if (tree.nearest(reach, reach, around).point < 0) {
      return found;
    }
  }
  for (const Ellipsoid& e : link.ellipsoids) {
    const kernels::PlacedEllipsoid ellipsoid = placed(X.p + X.R * e.mean, e.axes_T * X.R.transpose(), e.squares, e.extent);
    const auto measure = [&](const Balls& balls, int first, int count, double least, float* values) {
      return distances(ellipsoid, balls, first, count, least, values);
    };
    const PointTree::Nearest at = tree.nearest(found.clearance, stop, measure);
    if (at.point >= 0) {
      found = {at.distance, tree.order()[static_cast<std::size_t>(at.point)]};
      if (found.clearance < stop) {
        break;
      }
    }
  }
  return found;
}

double BodyClearance::look_at_pair(const Link& a, const Link& b, double cap, double stop,
                                   const Workspace& w) const noexcept {
  const Workspace::Pose &X = pose(w, a.joint), &Y = pose(w, b.joint);
  const Eigen::Vector3d between = Y.p + Y.R * b.centre - X.p - X.R * a.centre;
  double least = cap;
  const double far = a.radius + b.radius + cap;
  if (far <= 0.0 || between.squaredNorm() >= far * far) {
    return least;
  }
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
      const double squared = d.squaredNorm();
      if (cut <= 0.0 || squared >= cut * cut) {
        continue;
      }
      const Eigen::Vector3d n = d / std::max(std::sqrt(squared), closest_centres);
      const Eigen::Vector3d n_b = R_XY.transpose() * n;
      if (n.dot(d) - std::sqrt(n.dot(e.shape * n)) - std::sqrt(n_b.dot(f.shape * n_b)) < least) {  // not above the gap
        least = std::min(least, ellipsoid_gap(d, e.shape, R_XY * f.shape * R_XY.transpose()).value);
        if (least < stop) {
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

double BodyClearance::margin_at(int item, Eigen::Ref<const Eigen::VectorXd> q, const Margins& margins,
                                double& slope) const noexcept {
  double lowered = 0.0;
  for (const Margins::End& end : margins.ends) {
    const double deficit = end.deficits[item];
    if (deficit > 0.0) {
      slope = std::max(slope, deficit / margins.fade);
      const double away = items_[static_cast<std::size_t>(item)].reach.dot((q - end.q).cwiseAbs());
      lowered = std::max(lowered, deficit * std::max(0.0, 1.0 - away / margins.fade));
    }
  }
  return margin(item, margins) - lowered;
}

BodyClearance::Nearest BodyClearance::nearest(Eigen::Ref<const Eigen::VectorXd> q, const Obstacles& obstacles, double cap,
                                              Workspace& w) const noexcept {
  place(q, w);
  Nearest nearest{cap};
  for (int i = 0; i < num_items(); ++i) {
    const Found found = look(items_[static_cast<std::size_t>(i)], obstacles, nearest.clearance, -infinity, w);
    if (found.clearance < nearest.clearance) {
      nearest = {found.clearance, i, found.point};
    }
  }
  return nearest;
}

BodyClearance::Nearest BodyClearance::nearest(int item, Eigen::Ref<const Eigen::VectorXd> q, const Obstacles& obstacles,
                                              double cap, Workspace& w) const noexcept {
  place(q, w);
  const Found found = look(items_[static_cast<std::size_t>(item)], obstacles, cap, -infinity, w);
  return {found.clearance, found.clearance < cap ? item : -1, found.point};
}

void BodyClearance::clearances(Eigen::Ref<const Eigen::VectorXd> q, const Obstacles& obstacles, double cap, Workspace& w,
                               Eigen::Ref<Eigen::VectorXd> out) const noexcept {
  place(q, w);
  for (int i = 0; i < num_items(); ++i) {
    out[i] = look(items_[static_cast<std::size_t>(i)], obstacles, cap, -infinity, w).clearance;
  }
}

bool BodyClearance::free(Eigen::Ref<const Eigen::VectorXd> q, const Obstacles& obstacles, const Margins& margins,
                         Workspace& w) const noexcept {
  place(q, w);
  double slope = 0.0;
  for (int k = 0; k < num_items(); ++k) {
    // In the order of the items, but the one that was in the way last before all.
    const int i = k == 0 ? w.last_ : (k <= w.last_ ? k - 1 : k);
    const double margin = margin_at(i, q, margins, slope);
    if (look(items_[static_cast<std::size_t>(i)], obstacles, margin, margin, w).clearance < margin) {
      w.last_ = i;
      return false;
    }
  }
  return true;
}

bool BodyClearance::edge_free(Eigen::Ref<const Eigen::VectorXd> a, Eigen::Ref<const Eigen::VectorXd> b,
                              const Obstacles& obstacles, const Margins& margins, Workspace& w) const noexcept {
  w.difference_ = b - a;
  std::array<std::uint64_t, max_items / 64> all{};
  for (int i = 0; i < num_items(); ++i) {
    all[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
    w.motions_[static_cast<std::size_t>(i)] = motion(i, w.difference_);
  }
  // Breadth first: what is in the way is found early.
  w.intervals_.clear();
  w.intervals_.push_back({0.5, 0.5, all});
  for (std::size_t n = 0; n < w.intervals_.size(); ++n) {
    const Workspace::Interval at = w.intervals_[n];
    w.q_ = a + at.middle * w.difference_;
    place(w.q_, w);
    std::array<std::uint64_t, max_items / 64> open{};
    double decided = at.half;  // around the middle
    for (std::size_t word = 0; word < open.size(); ++word) {
      for (std::uint64_t left = at.open[word]; left != 0; left &= left - 1) {
        const int bit = std::countr_zero(left);
        const int i = static_cast<int>(word) * 64 + bit;
        double slope = 0.0;
        const double margin = margin_at(i, w.q_, margins, slope);
        const double speed = (1.0 + slope) * w.motions_[static_cast<std::size_t>(i)];
        const double enough = margin - margins.slack + at.half * speed;
        const double clearance =
            look(items_[static_cast<std::size_t>(i)], obstacles, std::max(margin, enough), margin, w).clearance;
        if (clearance < margin) {
          w.last_ = i;
          return false;
        }
        if (clearance < enough) {
          open[word] |= std::uint64_t{1} << bit;
          decided = std::min(decided, (clearance - margin + margins.slack) / speed);
        }
      }
    }
    if (decided < at.half) {
      if (w.intervals_.size() + 2 > most_intervals) {
        return false;
      }
      const double half = 0.5 * (at.half - decided), away = decided + half;
      w.intervals_.push_back({at.middle - away, half, open});
      w.intervals_.push_back({at.middle + away, half, open});
    }
  }
  return true;
}

}  // namespace sidestep
