#include "sidestep/clearance/gravity_torque_limit.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <utility>

namespace sidestep {
namespace {

constexpr double range_share = 0.1;                                   // Share of effort / weight within which the barrier acts.
constexpr double infinite = std::numeric_limits<double>::infinity();  // Bound where there is none.

SpatialMotion moved(const SpatialMotion& by, const SpatialMotion& screw) noexcept {
  return {by.angular.cross(screw.angular), by.angular.cross(screw.linear) + by.linear.cross(screw.angular)};
}

/// How far from the origin of its parent a joint's can be [m].
double farthest_place(const Robot& robot, const Joint& joint) noexcept {
  double length = joint.X_PJ.translation().norm();
  if (joint.type == JointType::prismatic) {
    for (const double end : {robot.limits().lower[joint.coordinate], robot.limits().upper[joint.coordinate]}) {
      length = std::max(length, joint.X_PJ.translation().norm() + std::abs(joint.multiplier * end + joint.offset));
    }
  }
  return length;
}

/// What every joint carries, itself included.
struct Burdens {
  std::vector<double> mass, moment;       // Masses [kg], and largest moments about the joint's origin [kg m].
  std::vector<std::vector<int>> carried;  // Joints that each carries, itself first.
};

Burdens burdens(const Robot& robot, const std::vector<Inertial>& inertials) {
  const std::vector<Joint>& joints = robot.joints();
  const auto num = joints.size();
  Burdens all{std::vector<double>(num), std::vector<double>(num), std::vector<std::vector<int>>(num)};
  auto& [mass, moment, carried] = all;
  for (std::size_t i = num; i-- > 0;) {
    mass[i] += inertials[i].mass;
    moment[i] += inertials[i].mass * inertials[i].com.norm();
    carried[i].insert(carried[i].begin(), static_cast<int>(i));
    if (joints[i].parent >= 0) {
      const auto parent = static_cast<std::size_t>(joints[i].parent);
      mass[parent] += mass[i];
      moment[parent] += moment[i] + (mass[i] > 0.0 ? mass[i] * farthest_place(robot, joints[i]) : 0.0);
      carried[parent].insert(carried[parent].end(), carried[i].begin(), carried[i].end());
    }
  }
  return all;
}

}  // namespace

GravityTorqueLimit::GravityTorqueLimit(const RigidBodyDynamics& dynamics, const Eigen::VectorXd& effort, double most)
    : robot_(dynamics.robot()), inertials_(dynamics.inertials()), gravity_(dynamics.gravity()) {
  const std::vector<Joint>& joints = robot_.joints();
  const auto num = joints.size();
  const auto nv = robot_.num_coordinates();
  const Burdens of_joints = burdens(robot_, inertials_);
  const std::vector<double>&mass = of_joints.mass, &moment = of_joints.moment;
  const std::vector<std::vector<int>>& carried = of_joints.carried;
  const double g = gravity_.norm();
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(nv), weight = largest;
  // Derivatives of the potential energy are bounded by the moment, or the weight, of what the last of their joints carries, if those
  // are on one chain; a prismatic joint turns nothing.
  const auto bound = [&](std::initializer_list<int> of) {
    const int last = std::max(of);
    double product =
        g *
        (joints[static_cast<std::size_t>(last)].type == JointType::revolute ? moment : mass)[static_cast<std::size_t>(last)];
    bool has_prismatic = false;
    for (const int i : of) {
      const Joint& joint = joints[static_cast<std::size_t>(i)];
      const std::vector<int>& below = carried[static_cast<std::size_t>(i)];
      const bool prismatic = joint.type == JointType::prismatic;
      if (std::find(below.begin(), below.end(), last) == below.end() || (prismatic && (i != last || has_prismatic))) {
        return 0.0;
      }
      has_prismatic = has_prismatic || prismatic;
      product *= std::abs(joint.multiplier);
    }
    return product;
  };
  const auto all = static_cast<int>(num);
  for (int i = 0; i < all; ++i) {
    const Joint& joint = joints[static_cast<std::size_t>(i)];
    largest[joint.coordinate] += bound({i});
    weight[joint.coordinate] += std::abs(joint.multiplier) * g * mass[static_cast<std::size_t>(i)];
  }
  for (int c = 0; c < nv; ++c) {
    if (!(weight[c] > 0.0) || !(effort[c] < infinite)) {
      continue;
    }
    const double activation = std::min(most, range_share * effort[c] / weight[c]);
    if (largest[c] + activation * weight[c] <= effort[c]) {
      continue;
    }
    Load load{c, effort[c], weight[c], activation, Eigen::VectorXd::Zero(nv), Eigen::MatrixXd::Zero(nv, nv), {}};
    for (int i = 0; i < all; ++i) {
      if (joints[static_cast<std::size_t>(i)].coordinate != c) {
        continue;
      }
      load.carriers.push_back({i, carried[static_cast<std::size_t>(i)]});
      for (int j = 0; j < all; ++j) {
        const int to = joints[static_cast<std::size_t>(j)].coordinate;
        load.steepest[to] += bound({i, j}) / weight[c];
        for (int k = 0; k < all; ++k) {
          load.bend(to, joints[static_cast<std::size_t>(k)].coordinate) += bound({i, j, k}) / weight[c];
        }
      }
    }
    loads_.push_back(std::move(load));
  }
}

double GravityTorqueLimit::value(const Load& load, const KinematicState& state) const noexcept {
  double torque = 0.0;
  for (const Load::Carrier& carrier : load.carriers) {
    const SpatialMotion& S = state.link(carrier.joint).screw;
    for (const int b : carrier.carried) {
      const KinematicState::Link& link = state.link(b);
      const Inertial& body = inertials_[static_cast<std::size_t>(b)];
      const Eigen::Vector3d com = link.p_WL + link.R_WL * body.com;
      torque -= body.mass * (S.linear + S.angular.cross(com)).dot(gravity_);
    }
  }
  return (load.effort - std::abs(torque)) / load.weight;
}

GravityTorqueLimit::DistanceLeft GravityTorqueLimit::at(const Load& load, const KinematicState& state,
                                                        Eigen::Ref<Eigen::VectorXd> gradient) const noexcept {
  // With the screw (ω, u) of the joint, what it carries, of mass m and moment c = Σ m x about the world origin, takes the torque
  //     g = −ω · (c × γ) − m u · γ,   γ gravity.
  // Where link V carries a screw, that changes by V × S, and a body's x by V.linear + V.angular × x.
  gradient.setZero();
  double torque = 0.0, curvature = 0.0;
  for (const Load::Carrier& carrier : load.carriers) {
    const KinematicState::Link& own = state.link(carrier.joint);
    const SpatialMotion& S = own.screw;
    const Eigen::Vector3d normal = gravity_.cross(S.angular);  // ω · (x × γ) = x · (γ × ω)
    double mass = 0.0;
    Eigen::Vector3d c = Eigen::Vector3d::Zero(), c1 = c, c2 = c;
    for (const int b : carrier.carried) {
      const KinematicState::Link& link = state.link(b);
      const Inertial& body = inertials_[static_cast<std::size_t>(b)];
      const Eigen::Vector3d com = link.p_WL + link.R_WL * body.com;
      const Eigen::Vector3d speed = link.velocity.linear + link.velocity.angular.cross(com);
      mass += body.mass;
      c += body.mass * com;
      c1 += body.mass * speed;
      c2 += body.mass * (link.bias.linear + link.bias.angular.cross(com) + link.velocity.angular.cross(speed));
      for (int k = b; k >= 0; k = state.link(k).parent) {
        const KinematicState::Link& joint = state.link(k);
        gradient[joint.coordinate] -= body.mass * (joint.screw.linear + joint.screw.angular.cross(com)).dot(normal);
      }
    }
    const Eigen::Vector3d moment = c.cross(gravity_);
    const auto of = [&](const SpatialMotion& screw) { return -screw.angular.dot(moment) - mass * screw.linear.dot(gravity_); };
    torque += of(S);
    for (int k = own.parent; k >= 0; k = state.link(k).parent) {
      gradient[state.link(k).coordinate] += of(moved(state.link(k).screw, S));
    }
    curvature -= c2.dot(normal);
    if (own.parent >= 0) {
      const KinematicState::Link& above = state.link(own.parent);
      const SpatialMotion first = moved(above.velocity, S);
      curvature += of(moved(above.bias, S)) + of(moved(above.velocity, first)) - 2.0 * first.angular.dot(c1.cross(gravity_));
    }
  }
  const double per = (torque > 0.0 ? -1.0 : 1.0) / load.weight;
  gradient *= per;
  return {(load.effort - std::abs(torque)) / load.weight, gradient.dot(state.v()), per * curvature};
}

void GravityTorqueLimit::evaluate(const KinematicState& state, const Obstacles& /*obstacles*/, double /*reach*/,
                                  const Horizon& ahead, ClearanceView out) const noexcept {
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const DistanceLeft left = at(loads_[i], state, out.gradients.col(k));
    const double within = std::min(ahead.distance, loads_[i].activation);
    if (!(left.value < within) && !(left.value + ahead.time * left.rate < within)) {
      continue;
    }
    const auto write = [&](ClearanceStateView& to) {
      to.values[k] = left.value;
      to.rates[k] = left.rate;
      to.curvatures[k] = left.curvature;
    };
    write(out);
    write(out.approach);
    out.approach.gradients.col(k) = out.gradients.col(k);
    out.nearest[k] = 0;
  }
}

CoordinateLabel GravityTorqueLimit::label(int k) const {
  const int coordinate = loads_[static_cast<std::size_t>(k)].coordinate;
  return {CoordinateLabel::Kind::effort, robot_.coordinate_names()[static_cast<std::size_t>(coordinate)]};
}

}  // namespace sidestep
