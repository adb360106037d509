#include "sidestep/attractor/goal.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../math/finite.hpp"
#include "outside.hpp"

namespace sidestep {
namespace {

// Damping λ of the pseudo-inverse [m/rad and 1]: directions that the joints move less than this count as not moved.
constexpr double singular_value_floor = 0.02;
// Distance of a goal beyond a limit that is rounding [rad | m], of a conversion or of a step along its velocity.
constexpr double limit_rounding = 1e-9;

void check_stiffness(double value, const char* name) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument("pose goal: " + std::string(name) + " is " + std::to_string(value) +
                                ", must be finite and not negative");
  }
}

}  // namespace

const Frame& moved_frame(const Robot& robot, const std::string& name, const std::string& what) {
  std::string allowed;
  for (const Frame& frame : robot.frames()) {
    if (frame.joint < 0) {
      continue;
    }
    if (frame.name == name) {
      return frame;
    }
    allowed += (allowed.empty() ? "" : ", ") + frame.name;
  }
  const int known = robot.frame_index(name);  // names those that there are
  throw std::invalid_argument(what + ": no joint of robot '" + robot.name() + "' moves frame '" +
                              robot.frames()[static_cast<std::size_t>(known)].name + "'; those that one moves: " + allowed);
}

JointGoal::JointGoal(Eigen::VectorXd q)
    : position(std::move(q)), velocity(Eigen::VectorXd::Zero(position.size())), acceleration(velocity) {}

JointGoal::JointGoal(Eigen::VectorXd q, Eigen::VectorXd v) : JointGoal(std::move(q), v, Eigen::VectorXd::Zero(v.size())) {}

JointGoal::JointGoal(Eigen::VectorXd q, Eigen::VectorXd v, Eigen::VectorXd a)
    : position(std::move(q)), velocity(std::move(v)), acceleration(std::move(a)) {
  if (velocity.size() != position.size() || acceleration.size() != position.size()) {
    throw std::invalid_argument("joint goal: velocity has " + std::to_string(velocity.size()) + " and acceleration " +
                                std::to_string(acceleration.size()) + " entries, position " + std::to_string(position.size()) +
                                "; must be equal");
  }
}

PoseGoal::PoseGoal(const Robot& robot, const std::string& frame, const Eigen::Isometry3d& X, PoseGoalSettings s,
                   const Vector6d& V)
    : pose(X), twist(V), settings(std::move(s)), made_for_{moved_frame(robot, frame, "pose goal"), robot.joints_hash()} {
  check_stiffness(settings.position_stiffness, "position stiffness");
  check_stiffness(settings.orientation_stiffness, "orientation stiffness");
  check_stiffness(settings.posture_stiffness, "posture stiffness");
  if (settings.rest.size() != 0 && settings.rest.size() != robot.num_coordinates()) {
    throw std::invalid_argument("pose goal: rest has " + std::to_string(settings.rest.size()) + " entries, expected " +
                                std::to_string(robot.num_coordinates()) + " or none");
  }
  if (settings.posture_stiffness > 0.0 && settings.rest.size() == 0) {
    throw std::invalid_argument("pose goal: a posture stiffness needs a rest configuration");
  }
  check_rotation(pose.linear(), "pose goal");
  // Lengths from the tip inwards; a prismatic joint adds its travel, a shoulder's own placement does not count.
  made_for_.reach = made_for_.frame.X_JF.translation().norm();
  for (int j = made_for_.frame.joint; j >= 0;) {
    const Joint& joint = robot.joints()[static_cast<std::size_t>(j)];
    if (joint.type == JointType::prismatic) {
      const JointLimits& limits = robot.limits();
      made_for_.reach += std::max(std::abs(joint.multiplier * limits.lower[joint.coordinate] + joint.offset),
                                  std::abs(joint.multiplier * limits.upper[joint.coordinate] + joint.offset));
    }
    if (joint.parent >= 0) {
      made_for_.reach += joint.X_PJ.translation().norm();
    } else {
      made_for_.shoulder = joint.X_PJ.translation();
    }
    j = joint.parent;
  }
}

PoseGoal::PoseGoal(MadeFor made_for, const Eigen::Isometry3d& X, PoseGoalSettings s, const Vector6d& V)
    : pose(X), twist(V), settings(std::move(s)), made_for_(std::move(made_for)) {}

PoseGoal& PoseGoal::add(PoseGoal other) {
  if (other.made_for_.joints_hash != made_for_.joints_hash) {
    throw std::invalid_argument("pose goal: the pose of frame '" + other.made_for_.frame.name +
                                "' is of a robot with other joints");
  }
  std::vector<PoseGoal> more = std::move(other.others);
  other.others.clear();
  more.insert(more.begin(), std::move(other));
  for (PoseGoal& one : more) {
    const auto same = [&](const PoseGoal& known) { return known.made_for_.frame.name == one.made_for_.frame.name; };
    if (same(*this) || std::any_of(others.begin(), others.end(), same)) {
      throw std::invalid_argument("pose goal: frame '" + one.made_for_.frame.name +
                                  "' has two poses, allowed: one of each frame");
    }
    others.push_back(std::move(one));
  }
  return *this;
}

bool advance(Goal& goal, double duration) noexcept {
  if (auto* joint = std::get_if<JointGoal>(&goal)) {
    const auto velocity = joint->velocity + duration * joint->acceleration;
    const auto position = joint->position + (duration * joint->velocity + 0.5 * duration * duration * joint->acceleration);
    if (!all_finite(position) || !all_finite(velocity)) {
      return false;
    }
    joint->position = position;
    joint->velocity = velocity;
    return true;
  }
  return advance(std::get<PoseGoal>(goal), duration);
}

bool advance(PoseGoal& frame, double duration) noexcept {
  const Eigen::Vector3d position = frame.pose.translation() + duration * frame.twist.head<3>();
  const Eigen::Vector3d turn = duration * frame.twist.tail<3>();
  const double angle = turn.norm();
  if (!position.allFinite() || !std::isfinite(angle)) {
    return false;
  }
  frame.pose.translation() = position;
  if (angle > 0.0) {
    frame.pose.linear() = Eigen::AngleAxisd(angle, turn / angle) * frame.pose.linear();
  }
  return std::all_of(frame.others.begin(), frame.others.end(), [&](PoseGoal& other) { return advance(other, duration); });
}

bool is_moving(const Goal& goal) noexcept {
  if (const auto* joint = std::get_if<JointGoal>(&goal)) {
    return !joint->velocity.isZero(0.0) || !joint->acceleration.isZero(0.0);
  }
  const PoseGoal& pose = std::get<PoseGoal>(goal);
  return !pose.twist.isZero(0.0) ||
         std::any_of(pose.others.begin(), pose.others.end(), [](const PoseGoal& other) { return !other.twist.isZero(0.0); });
}

namespace {

GoalFault check_pose(const PoseGoal& frame, const Robot& robot) noexcept {
  if (!frame.is_for(robot) || !frame.pose.matrix().allFinite() || !frame.twist.allFinite() ||
      !frame.settings.rest.allFinite()) {
    return GoalFault::invalid;
  }
  GoalFault worst =
      (frame.pose.translation() - frame.shoulder()).norm() > frame.reach() ? GoalFault::out_of_reach : GoalFault::none;
  for (const PoseGoal& other : frame.others) {
    const GoalFault fault = check_pose(other, robot);
    worst = fault == GoalFault::invalid || worst == GoalFault::none ? fault : worst;
  }
  return worst;
}

}  // namespace

GoalFault check(const Goal& goal, const Robot& robot) noexcept {
  if (const auto* joint = std::get_if<JointGoal>(&goal)) {
    return with_size(robot.num_coordinates(), [&](auto nv) {
      for (const Eigen::VectorXd* part : {&joint->position, &joint->velocity, &joint->acceleration}) {
        if (part->size() != nv || !all_finite(sized(*part, nv))) {
          return GoalFault::invalid;
        }
      }
      return is_outside(sized(joint->position, nv), robot.limits(), nv, limit_rounding) ? GoalFault::outside_limits
                                                                                        : GoalFault::none;
    });
  }
  return check_pose(std::get<PoseGoal>(goal), robot);
}

GoalPotential::GoalPotential(int nv)
    : gradient(Eigen::VectorXd::Zero(nv)),
      velocity(gradient),
      displacement_(gradient),
      jacobian_transposed_(Eigen::MatrixXd::Zero(nv, 6)) {}

void GoalPotential::update(const Goal& goal, const KinematicState& state, const Gain& stiffness) noexcept {
  if (const auto* joint = std::get_if<JointGoal>(&goal)) {
    update(*joint, state, stiffness);
  } else {
    update(std::get<PoseGoal>(goal), state);
  }
}

void GoalPotential::release() noexcept {
  potential = joint_error = position_error = rotation_error = nan;
  gradient.setZero();
  velocity.setZero();
}

void GoalPotential::update(const JointGoal& goal, const KinematicState& state, const Gain& stiffness) noexcept {
  with_size(gradient.size(), [&](auto nv) {
    auto displacement = sized(displacement_, nv), force = sized(gradient, nv);
    displacement = sized(state.q(), nv) - sized(goal.position, nv);
    stiffness.multiply(displacement, force, nv);
    potential = 0.5 * displacement.dot(force);
    force -= sized(goal.acceleration, nv);
    sized(velocity, nv) = sized(goal.velocity, nv);
    joint_error = displacement.cwiseAbs().maxCoeff();
  });
  position_error = rotation_error = nan;
}

int GoalPotential::farthest_coordinate() const noexcept {
  Eigen::Index farthest = -1;
  if (!std::isnan(joint_error)) {
    displacement_.cwiseAbs().maxCoeff(&farthest);
  }
  return static_cast<int>(farthest);
}

void GoalPotential::update(const PoseGoal& goal, const KinematicState& state) noexcept {
  potential = position_error = 0.0;
  joint_error = rotation_error = nan;
  gradient.setZero();
  velocity.setZero();
  add(goal, goal.settings.posture_stiffness > 0.0, state);
  for (const PoseGoal& other : goal.others) {
    add(other, false, state);
  }
}

void GoalPotential::add(const PoseGoal& goal, bool posture, const KinematicState& state) noexcept {
  const PoseGoalSettings& settings = goal.settings;
  const KinematicState::Link& link = state.link(goal.frame().joint);
  const Eigen::Matrix3d R = link.R_WL * goal.frame().X_JF.linear();
  const Eigen::Vector3d p = link.p_WL + link.R_WL * goal.frame().X_JF.translation();

  // U and its derivative by the frame's displacement and rotation (world).
  const Eigen::Vector3d offset = p - goal.pose.translation();
  const Eigen::Vector3d phi = rotation_vector(goal.pose.linear().transpose() * R);
  const double k_R = settings.position_only ? 0.0 : settings.orientation_stiffness;
  potential += 0.5 * settings.position_stiffness * offset.squaredNorm() + 0.5 * k_R * phi.squaredNorm();
  position_error = std::max(position_error, offset.norm());
  if (!settings.position_only) {
    rotation_error = std::isnan(rotation_error) ? phi.norm() : std::max(rotation_error, phi.norm());
  }
  Vector6d force;
  force << settings.position_stiffness * offset, k_R * (R * phi);

  jacobian_transposed_.setZero();
  for (int j = goal.frame().joint; j >= 0; j = state.link(j).parent) {
    const KinematicState::Link& mover = state.link(j);
    jacobian_transposed_.row(mover.coordinate).head<3>() += (mover.screw.linear + mover.screw.angular.cross(p)).transpose();
    if (!settings.position_only) {
      jacobian_transposed_.row(mover.coordinate).tail<3>() += mover.screw.angular.transpose();
    }
  }
  gradient += jacobian_transposed_.lazyProduct(force);

  const bool moving = !goal.twist.isZero(0.0);
  if (!posture && !moving) {
    return;
  }
  Eigen::Matrix<double, 6, 6> gram = jacobian_transposed_.transpose().lazyProduct(jacobian_transposed_);
  gram.diagonal().array() += singular_value_floor * singular_value_floor;
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factor(gram);
  if (posture) {
    displacement_ = settings.posture_stiffness * (state.q() - settings.rest);
    const Vector6d seen = factor.solve(Vector6d(jacobian_transposed_.transpose().lazyProduct(displacement_)));
    gradient += displacement_ - jacobian_transposed_.lazyProduct(seen);
  }
  if (moving) {
    const Vector6d seen = factor.solve(goal.twist);
    velocity += jacobian_transposed_.lazyProduct(seen);
  }
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) noexcept {
  // By the quaternion of positive real part: its vector part keeps all digits near a half turn.
  Eigen::Quaterniond quaternion(rotation);
  if (quaternion.w() < 0.0) {
    quaternion.coeffs() = -quaternion.coeffs();
  }
  const double sine = quaternion.vec().norm();
  if (!(sine > 0.0)) {
    return Eigen::Vector3d::Zero();
  }
  return 2.0 * std::atan2(sine, quaternion.w()) / sine * quaternion.vec();
}

}  // namespace sidestep
