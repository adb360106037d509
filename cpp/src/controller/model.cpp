// What the stages of a controller are made from.
#include "model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/settings.hpp"
#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/attractor/joint_limit_barrier.hpp"
#include "sidestep/controller/motion.hpp"

namespace sidestep {
namespace {

constexpr double usable_acceleration =
    0.9;  // share of the limits for velocities, twists and trajectories: the rest is for feedback
constexpr double default_look_period = 0.02;  // period of looks at places where there is no planner [s]

/// All that must keep apart; what joints hold only of an arm moved by torque, as far as effort margins leave it.
std::shared_ptr<const ClearanceItems> make_items(const Arm& arm, const ControllerSettings& settings, bool torque) {
  std::optional<GravityTorqueLimit> gravity_torque;
  if (torque && arm.has_dynamics()) {
    const Eigen::VectorXd effort = (1.0 - settings.effort_margin) * arm.robot().limits().effort;
    gravity_torque.emplace(arm.dynamics(), effort, settings.barriers.self_activation);
  }
  return std::make_shared<const ClearanceItems>(arm.robot(), arm.body(), arm.pairs(), std::vector<KeptPlane>{}, arm.tables(),
                                                std::move(gravity_torque), settings.barriers.temperature);
}

std::shared_ptr<const GeometricSystem> make_system(const ClearanceItems& items, const BarrierSettings& b) {
  const Robot& robot = items.robot();
  const int nv = robot.num_coordinates();
  std::vector<std::shared_ptr<const Embedding>> parts;
  const auto add = [&](std::shared_ptr<const ClearanceGroup> group, const BarrierFunction& function) {
    if (group && group->size() > 0) {
      parts.push_back(std::make_shared<ClearanceBarrier>(robot, std::move(group), function));
    }
  };
  add(items.obstacles(), {b.activation, b.strength, b.power, b.floor});
  if (robot.limits().lower.array().isFinite().any() || robot.limits().upper.array().isFinite().any()) {
    parts.push_back(std::make_shared<JointLimitBarrier>(
        robot, BarrierFunction{b.limit_activation, b.limit_strength, b.power, std::min(b.floor, 0.5 * b.limit_activation)}));
  }
  const BarrierFunction self{b.self_activation, b.self_strength, b.power, b.floor};
  add(items.tables(), self);
  add(items.pairs(), self);
  add(items.gravity_torque(), self);
  GeometricSystemSettings settings;
  settings.stiffness = b.stiffness * Eigen::MatrixXd::Identity(nv, nv);
  settings.damping = b.damping * Eigen::MatrixXd::Identity(nv, nv);
  settings.pull_form = PullForm::one_sided;
  return std::make_shared<GeometricSystem>(robot, std::move(parts), std::move(settings));
}

bool use_torque(const Arm& arm, ControllerSettings::Output output) {
  const bool possible = arm.has_dynamics() && arm.robot().limits().effort.allFinite();
  std::string without;
  for (int j = 0; j < arm.num_coordinates(); ++j) {
    if (!std::isfinite(arm.robot().limits().effort[j])) {
      without += (without.empty() ? "'" : ", '") + arm.robot().coordinate_names()[static_cast<std::size_t>(j)] + "'";
    }
  }
  if (output == ControllerSettings::Output::torque && !without.empty()) {
    throw std::invalid_argument("controller: output is torque, but arm '" + arm.name() + "' has no effort limit of " + without +
                                "; give them when it is loaded (effort_limits), or ask for acceleration");
  }
  return output == ControllerSettings::Output::torque || (output == ControllerSettings::Output::automatic && possible);
}

ControllerSettings valid(ControllerSettings settings) {
  settings.validate();
  return settings;
}

/// Coordinates in metres.
std::vector<Eigen::Index> clearances_of(const GeometricSystem& system) {
  std::vector<Eigen::Index> found;
  for (std::size_t k = 0; k < system.labels().size(); ++k) {
    const CoordinateLabel::Kind kind = system.labels()[k].kind;
    if (kind != CoordinateLabel::Kind::joint_limit && kind != CoordinateLabel::Kind::effort) {
      found.push_back(static_cast<Eigen::Index>(k));
    }
  }
  return found;
}

}  // namespace

std::vector<bool> unlimited_joints(const Robot& robot) {
  const JointLimits& limits = robot.limits();
  std::vector<bool> unlimited(static_cast<std::size_t>(robot.num_coordinates()));
  for (Eigen::Index j = 0; j < limits.lower.size(); ++j) {
    unlimited[static_cast<std::size_t>(j)] = limits.lower[j] == -infinity && limits.upper[j] == infinity;
  }
  for (const Joint& joint : robot.joints()) {
    if (joint.type != JointType::revolute || std::abs(joint.multiplier) != 1.0) {
      unlimited[static_cast<std::size_t>(joint.coordinate)] = false;
    }
  }
  return unlimited;
}

JointKinds::JointKinds(const Robot& robot)
    : slides_(static_cast<std::size_t>(robot.num_coordinates()), false), unlimited_(unlimited_joints(robot)) {
  for (const Joint& joint : robot.joints()) {
    const auto j = static_cast<std::size_t>(joint.coordinate);
    slides_[j] = slides_[j] || joint.type == JointType::prismatic;
  }
}

ControllerModel::ControllerModel(Arm a, ControllerSettings s)
    : arm(std::move(a)),
      settings(valid(std::move(s))),
      torque(use_torque(arm, settings.output)),
      dynamics(torque && arm.has_dynamics() ? std::optional(arm.dynamics()) : std::nullopt),
      body(make_items(arm, settings, torque)),
      system(make_system(body.items(), settings.barriers)),
      plausible(arm.robot(), body.reach()),
      joints(arm.robot()),
      usable{settings.speed * (1.0 - settings.limit_margin) * arm.robot().limits().velocity,
             settings.speed * usable_acceleration * arm.robot().limits().acceleration},
      clearances(clearances_of(*system)),
      look_period(settings.planner ? settings.planner->period : default_look_period) {}

}  // namespace sidestep
