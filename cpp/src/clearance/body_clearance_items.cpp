// What a body's items are made of: links in ellipsoids, how far they can move, tables.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sidestep/clearance/body_clearance.hpp"

namespace sidestep {
namespace {

constexpr double cover_overshoot = 0.04;  // [m] of the balls that cover an ellipsoid

double across(const Eigen::Vector3d& offset, const Eigen::Vector3d& axis) { return offset.cross(axis).norm(); }

}  // namespace

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
      link.ellipsoids.push_back(
          {e.mean, eigen.eigenvectors().transpose(), eigen.eigenvalues(), e.shape, e.extent,
           cover_by_balls(e.mean, eigen.eigenvectors().transpose(), eigen.eigenvalues(), cover_overshoot)});
      link.centre += e.mean;
    }
  }
  if (link.ellipsoids.empty()) {
    throw std::invalid_argument("body clearance: the body has no ellipsoid on link '" + name + "'");
  }
  link.centre /= static_cast<double>(link.ellipsoids.size());
  for (const Ellipsoid& e : link.ellipsoids) {
    link.radius = std::max(link.radius, (e.mean - link.centre).norm() + e.extent);
  }
  links_.push_back(std::move(link));
  return static_cast<int>(links_.size()) - 1;
}

void BodyClearance::add_reach(Item& item, const Link& link) const {
  // Up the chain, with a ball around the origin below that holds the link in every configuration.
  double ball = 0.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();                  // of that origin, from joint j
  Eigen::VectorXd later = Eigen::VectorXd::Zero(item.reach.size());  // R of the joints from here to the link
  for (int j = link.joint; j != item.base;) {
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
    const double factor = std::abs(joint.multiplier), R = factor * (turns ? radius : 1.0);
    item.reach[joint.coordinate] += R;
    later[joint.coordinate] += R;
    if (turns) {
      // All later ones turn with it, and the pairs (i, j) and (j, i) count alike; itself once.
      item.bend.row(joint.coordinate) += 2.0 * factor * later.transpose();
      item.bend(joint.coordinate, joint.coordinate) -= factor * R;
    } else {
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

void BodyClearance::add_tables() {
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    const ClearanceTable& table = tables_[i];
    robot_.frame_index(table.first), robot_.frame_index(table.second);
    table.validate(robot_.num_coordinates());
    Item item({CoordinateLabel::Kind::self, table.first, table.second}, -1, robot_.num_coordinates());
    item.table = static_cast<int>(i);
    const Eigen::Vector2d steepest = table.steepest();
    item.reach[table.axes[0].coordinate] = steepest[0];
    item.reach[table.axes[1].coordinate] = steepest[1];
    items_.push_back(std::move(item));
  }
}

void BodyClearance::add_loads() {
  if (!holding_) {
    return;
  }
  for (std::size_t i = 0; i < holding_->loads().size(); ++i) {
    const HoldingTorque::Load& load = holding_->loads()[i];
    const std::string& name = robot_.coordinate_names()[static_cast<std::size_t>(load.coordinate)];
    Item item({CoordinateLabel::Kind::effort, name}, -1, robot_.num_coordinates());
    item.load = static_cast<int>(i);
    item.reach = load.steepest;
    item.bend = load.bend;
    item.most_margin = Barrier::margin_share * load.activation;
    items_.push_back(std::move(item));
  }
}

}  // namespace sidestep
