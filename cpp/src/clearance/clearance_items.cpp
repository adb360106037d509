#include "sidestep/clearance/clearance_items.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace sidestep {
namespace {

using Source = ClearanceItem::Source;

constexpr const char* items_owner = "body clearance";  // Name in error messages.
// Longest activation distance that a margin of a pair is a share of [m]: above that of links that are usually near.
constexpr double most_activation = 0.05;

double across(const Eigen::Vector3d& offset, const Eigen::Vector3d& axis) { return offset.cross(axis).norm(); }

double most_margin_of(const ClearanceGroup& group, int k) {
  return ClearanceGroup::margin_share * std::min(most_activation, group.longest_activation(k));
}

/// The last joint above both, -1: none. Parents have smaller indices.
int joint_above(const Robot& robot, int i, int j) {
  while (i != j) {
    int& later = i > j ? i : j;
    later = robot.joints()[static_cast<std::size_t>(later)].parent;
  }
  return i;
}

using Items = std::vector<ClearanceItem>;

void add_reach(ClearanceItem& item, const Robot& robot, const LinkEllipsoids& link) {
  // Up the chain, with a ball around the origin below that holds the link in every configuration.
  double ball = 0.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();                  // Origin of the next joint, from joint j [m].
  Eigen::VectorXd later = Eigen::VectorXd::Zero(item.reach.size());  // R of the joints from here to the link.
  for (int j = link.joint; j != item.base;) {
    const Joint& joint = robot.joints()[static_cast<std::size_t>(j)];
    double radius = 0.0, next = 0.0;  // Distance from the axis; then the ball around j.
    if (j == link.joint) {
      for (const LinkEllipsoid& e : link.ellipsoids) {
        radius = std::max(radius, across(e.mean, joint.axis) + e.extent);
        next = std::max(next, e.mean.norm() + e.extent);
      }
    } else {
      radius = across(offset, joint.axis) + ball;
      next = offset.norm() + ball;
    }
    const bool turns = joint.type == JointType::revolute;
    const double factor = std::abs(joint.multiplier), R = factor * (turns ? radius : 1.0);
    item.reach[joint.coordinate] += R;
    later[joint.coordinate] += R;
    if (turns) {
      // All later ones turn with it, and the pairs (i, j) and (j, i) count alike; itself once.
      item.bend.row(joint.coordinate) += 2.0 * factor * later.transpose();
      item.bend(joint.coordinate, joint.coordinate) -= factor * R;
    } else {
      const JointLimits& limits = robot.limits();
      const double low = joint.multiplier * limits.lower[joint.coordinate] + joint.offset;
      const double high = joint.multiplier * limits.upper[joint.coordinate] + joint.offset;
      next += std::max(std::abs(low), std::abs(high));
    }
    ball = next;
    offset = joint.X_PJ.translation();
    j = joint.parent;
  }
}

void add_obstacles(Items& items, const Robot& robot, const BodyLinks& links) {
  for (int link = 0; link < links.size(); ++link) {
    const LinkEllipsoids& ellipsoids = links[link];
    if (ellipsoids.joint >= 0) {
      items.emplace_back(Source::obstacles, link, CoordinateLabel{CoordinateLabel::Kind::obstacle, ellipsoids.name},
                         robot.num_coordinates());
      items.back().link = link;
      add_reach(items.back(), robot, ellipsoids);
    }
  }
}

void add_pairs(Items& items, const Robot& robot, const BodyLinks& links, const PairClearances& pairs) {
  for (int k = 0; k < pairs.size(); ++k) {
    const PairClearances::Pair& of = pairs[k];
    ClearanceItem& pair = items.emplace_back(Source::pair, k, pairs.label(k), robot.num_coordinates());
    pair.contact = of.contact;
    pair.link = of.first;
    pair.other = of.second;
    const LinkEllipsoids &first = links[of.first], &second = links[of.second];
    pair.base = joint_above(robot, first.joint, second.joint);  // what is above it moves both alike
    add_reach(pair, robot, first);
    add_reach(pair, robot, second);
    pair.most_margin = most_margin_of(pairs, k);
  }
}

void add_plane(Items& items, const Robot& robot, const BodyLinks& links, const PlaneClearances& plane, int number) {
  for (int k = 0; k < plane.size(); ++k) {
    ClearanceItem& item = items.emplace_back(Source::plane, number, plane.label(k), robot.num_coordinates());
    item.link = plane.link(k);
    add_reach(item, robot, links[item.link]);
  }
}

void add_tables(Items& items, const Robot& robot, const TableClearances& tables) {
  for (int k = 0; k < tables.size(); ++k) {
    const PairDistanceTable& table = tables[k];
    ClearanceItem& item = items.emplace_back(Source::table, k, tables.label(k), robot.num_coordinates());
    const Eigen::Vector2d steepest = table.steepest();
    item.reach[table.axes[0].coordinate] = steepest[0];
    item.reach[table.axes[1].coordinate] = steepest[1];
    item.most_margin = most_margin_of(tables, k);
  }
}

void add_loads(Items& items, const Robot& robot, const GravityTorqueLimit& limit) {
  for (int k = 0; k < limit.size(); ++k) {
    const GravityTorqueLimit::Load& load = limit.loads()[static_cast<std::size_t>(k)];
    ClearanceItem& item = items.emplace_back(Source::load, k, limit.label(k), robot.num_coordinates());
    item.reach = load.steepest;
    item.bend = load.bend;
    item.most_margin = ClearanceGroup::margin_share * load.activation;
  }
}

}  // namespace

ClearanceItem::ClearanceItem(Source from, int number, CoordinateLabel what, Eigen::Index nv)
    : source(from),
      index(number),
      label(std::move(what)),
      reach(Eigen::VectorXd::Zero(nv)),
      bend(Eigen::MatrixXd::Zero(nv, nv)) {}

ClearanceItems::ClearanceItems(Robot robot, const Body& body, const std::vector<LinkPair>& pairs,
                               const std::vector<KeptPlane>& planes, std::vector<PairDistanceTable> tables,
                               std::optional<GravityTorqueLimit> gravity_torque, double temperature)
    : robot_(std::move(robot)),
      links_(std::make_shared<BodyLinks>(robot_, body, items_owner)),
      obstacles_(std::make_shared<ClearanceField>(robot_, body, temperature)) {
  if (!pairs.empty()) {
    pairs_ = std::make_shared<PairClearances>(robot_, links_, pairs, temperature, items_owner);
  }
  for (const KeptPlane& plane : planes) {
    planes_.push_back(std::make_shared<PlaneClearances>(robot_, links_, plane, temperature, items_owner));
  }
  if (!tables.empty()) {
    tables_ = std::make_shared<TableClearances>(robot_, std::move(tables), items_owner);
  }
  if (gravity_torque) {
    gravity_torque_ = std::make_shared<GravityTorqueLimit>(*std::move(gravity_torque));
  }
  add_obstacles(items_, robot_, *links_);
  num_obstacles_ = size();
  if (pairs_) {
    add_pairs(items_, robot_, *links_, *pairs_);
  }
  for (int n = 0; n < static_cast<int>(planes_.size()); ++n) {
    add_plane(items_, robot_, *links_, *planes_[static_cast<std::size_t>(n)], n);
  }
  if (tables_) {
    add_tables(items_, robot_, *tables_);
  }
  if (gravity_torque_) {
    add_loads(items_, robot_, *gravity_torque_);
  }
  const Eigen::Index nv = robot_.num_coordinates();
  reach_ = Eigen::VectorXd::Zero(nv);
  reaches_.resize(size(), nv);
  bends_.resize(size(), nv * nv);
  for (Eigen::Index k = 0; const ClearanceItem& i : items_) {
    reaches_.row(k) = i.reach.transpose();
    bends_.row(k++) = i.bend.transpose().reshaped().transpose();
    if (!i.reach.allFinite()) {
      throw std::invalid_argument(std::string(items_owner) + ": a prismatic joint above link '" + i.label.name +
                                  "' has no position limits, so that no edge could be proven free");
    }
    reach_ = reach_.cwiseMax(i.reach);
  }
}

}  // namespace sidestep
