#include "sidestep/robot/dynamics.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sidestep {
namespace {

// Asymmetry, or negative eigenvalue, of an inertia that is accepted, relative to the largest entry: files give a few digits, and bodies
// are thin.
constexpr double inertia_tolerance = 1e-6;
// Absolute tolerance per kilogram, of one kilogram at least [kg m^2]: zeros of CAD exports, and sums.
constexpr double inertia_rounding = 1e-12;

/// The inertia of a point mass about the origin, m (|c|² 1 - c cᵀ).
Eigen::Matrix3d point_inertia(double mass, const Eigen::Vector3d& c) noexcept {
  return mass * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
}

}  // namespace

void Inertial::validate(const std::string& owner) const {
  if (!(mass >= 0.0) || !std::isfinite(mass)) {
    throw std::invalid_argument(owner + ": mass is " + std::to_string(mass) + " kg, must be finite and not negative");
  }
  if (!com.allFinite()) {
    throw std::invalid_argument(owner + ": centre of mass must be finite");
  }
  const double tolerance = inertia_tolerance * inertia.cwiseAbs().maxCoeff() + inertia_rounding * std::max(1.0, mass);
  if (!inertia.allFinite() || (inertia - inertia.transpose()).cwiseAbs().maxCoeff() > tolerance ||
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues()[0] < -tolerance) {
    throw std::invalid_argument(owner + ": rotational inertia must be symmetric and positive semidefinite");
  }
}

std::vector<Inertial> fold_inertials(const Robot& robot, const std::vector<Inertial>& links) {
  if (links.size() != robot.frames().size()) {
    throw std::invalid_argument("robot '" + robot.name() + "' has " + std::to_string(robot.frames().size()) + " links and " +
                                std::to_string(links.size()) + " inertias; give one each");
  }
  std::vector<Inertial> folded(static_cast<std::size_t>(robot.num_joints()));
  for (std::size_t i = 0; i < links.size(); ++i) {
    const Frame& frame = robot.frames()[i];
    links[i].validate("link '" + frame.name + "'");
    if (frame.joint >= 0) {
      Inertial& body = folded[static_cast<std::size_t>(frame.joint)];
      body.mass += links[i].mass;
      body.com += links[i].mass * (frame.X_JF * links[i].com);
    }
  }
  for (Inertial& body : folded) {
    body.com = body.mass > 0.0 ? Eigen::Vector3d(body.com / body.mass) : Eigen::Vector3d::Zero();
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    const Frame& frame = robot.frames()[i];
    if (frame.joint >= 0) {
      Inertial& body = folded[static_cast<std::size_t>(frame.joint)];
      const Eigen::Matrix3d R = frame.X_JF.linear();
      body.inertia += R * links[i].inertia * R.transpose() + point_inertia(links[i].mass, frame.X_JF * links[i].com - body.com);
    }
  }
  return folded;
}

RigidBodyDynamics::RigidBodyDynamics(Robot robot, std::vector<Inertial> inertials, const Eigen::Vector3d& gravity)
    : robot_(std::move(robot)), inertials_(std::move(inertials)), gravity_(gravity) {
  if (inertials_.size() != robot_.joints().size()) {
    throw std::invalid_argument("robot '" + robot_.name() + "' has " + std::to_string(robot_.num_joints()) + " joints and " +
                                std::to_string(inertials_.size()) + " inertias; give one each");
  }
  for (std::size_t i = 0; i < inertials_.size(); ++i) {
    inertials_[i].validate("inertia of joint '" + robot_.joints()[i].name + "'");
  }
  if (!gravity_.allFinite()) {
    throw std::invalid_argument("gravity must be finite");
  }
}

RigidBodyDynamics::Workspace::Workspace(const RigidBodyDynamics& dynamics)
    : state_(dynamics.robot_),
      composites_(dynamics.inertials_.size()),
      forces_(dynamics.inertials_.size()),
      rest_(Eigen::VectorXd::Zero(dynamics.robot_.num_coordinates())) {}

void RigidBodyDynamics::mass_matrix(ConstVectorRef q, Workspace& workspace, Eigen::Ref<Eigen::MatrixXd> mass) const noexcept {
  workspace.state_.update(robot_, q, workspace.rest_);
  mass_matrix(workspace.state_, workspace, mass);
}

void RigidBodyDynamics::bias(ConstVectorRef q, ConstVectorRef v, Workspace& workspace,
                             Eigen::Ref<Eigen::VectorXd> force) const noexcept {
  workspace.state_.update(robot_, q, v);
  bias(workspace.state_, workspace, force);
}

void RigidBodyDynamics::mass_matrix(const KinematicState& state, Workspace& workspace,
                                    Eigen::Ref<Eigen::MatrixXd> mass) const noexcept {
  auto& bodies = workspace.composites_;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const KinematicState::Link& link = state.link(static_cast<int>(i));
    const Inertial& inertial = inertials_[i];
    const Eigen::Vector3d com = link.p_WL + link.R_WL * inertial.com;
    bodies[i].mass = inertial.mass;
    bodies[i].first = inertial.mass * com;
    const Eigen::Matrix3d turned = link.R_WL * inertial.inertia;
    bodies[i].second.noalias() = turned * link.R_WL.transpose();
    bodies[i].second += point_inertia(inertial.mass, com);
  }
  mass.setZero();
  for (int i = robot_.num_joints() - 1; i >= 0; --i) {
    const KinematicState::Link& link = state.link(i);
    const auto& body = bodies[static_cast<std::size_t>(i)];
    // The momentum of the composite body when this coordinate has speed 1.
    const Eigen::Vector3d linear = body.mass * link.screw.linear + link.screw.angular.cross(body.first);
    const Eigen::Vector3d angular = body.second * link.screw.angular + body.first.cross(link.screw.linear);
    const auto along = [&](const SpatialMotion& screw) { return screw.angular.dot(angular) + screw.linear.dot(linear); };
    mass(link.coordinate, link.coordinate) += along(link.screw);
    for (int j = link.parent; j >= 0; j = state.link(j).parent) {
      const double value = along(state.link(j).screw);
      mass(link.coordinate, state.link(j).coordinate) += value;
      mass(state.link(j).coordinate, link.coordinate) += value;
    }
    if (link.parent >= 0) {
      auto& parent = bodies[static_cast<std::size_t>(link.parent)];
      parent.mass += body.mass;
      parent.first += body.first;
      parent.second += body.second;
    }
  }
}

void RigidBodyDynamics::bias(const KinematicState& state, Workspace& workspace,
                             Eigen::Ref<Eigen::VectorXd> force) const noexcept {
  auto& forces = workspace.forces_;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const KinematicState::Link& link = state.link(static_cast<int>(i));
    const Inertial& inertial = inertials_[i];
    const Eigen::Vector3d& omega = link.velocity.angular;
    const Eigen::Vector3d com = link.p_WL + link.R_WL * inertial.com;
    const Eigen::Vector3d speed = link.velocity.linear + omega.cross(com);
    const Eigen::Vector3d acceleration = link.bias.linear + link.bias.angular.cross(com) + omega.cross(speed);
    const auto turned = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
      return link.R_WL * (inertial.inertia * (link.R_WL.transpose() * x));
    };
    forces[i].linear = inertial.mass * (acceleration - gravity_);
    forces[i].angular = turned(link.bias.angular) + omega.cross(turned(omega)) + com.cross(forces[i].linear);
  }
  project(state, workspace, force);
}

void RigidBodyDynamics::gravity(const KinematicState& state, Workspace& workspace,
                                Eigen::Ref<Eigen::VectorXd> force) const noexcept {
  auto& forces = workspace.forces_;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const KinematicState::Link& link = state.link(static_cast<int>(i));
    const Eigen::Vector3d com = link.p_WL + link.R_WL * inertials_[i].com;
    forces[i].linear = -inertials_[i].mass * gravity_;
    forces[i].angular = com.cross(forces[i].linear);
  }
  project(state, workspace, force);
}

void RigidBodyDynamics::project(const KinematicState& state, Workspace& workspace,
                                Eigen::Ref<Eigen::VectorXd> force) const noexcept {
  auto& forces = workspace.forces_;
  force.setZero();
  for (int i = robot_.num_joints() - 1; i >= 0; --i) {
    const KinematicState::Link& link = state.link(i);
    const SpatialForce& carried = forces[static_cast<std::size_t>(i)];
    force[link.coordinate] += link.screw.angular.dot(carried.angular) + link.screw.linear.dot(carried.linear);
    if (link.parent >= 0) {
      SpatialForce& parent = forces[static_cast<std::size_t>(link.parent)];
      parent.linear += carried.linear;
      parent.angular += carried.angular;
    }
  }
}

}  // namespace sidestep
