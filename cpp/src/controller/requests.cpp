// Requests as they are set: what is wrong with them is refused, what is hard to believe is questioned.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double pose_position_share = 2.0,
                 pose_rotation_share = 0.5;  // Stiffness of pose goals as a share of the barriers' stiffness [1/m², 1/rad²].

/// Throws what is wrong with the sizes and numbers of a goal, or the robot that it was made for.
[[noreturn]] void refuse_goal(const JointGoal& goal, const Robot& robot) {
  const std::vector<std::string>& joints = robot.coordinate_names();
  using Part = std::pair<const char*, const Eigen::VectorXd*>;
  for (const auto& [name, part] :
       {Part("position", &goal.position), Part("velocity", &goal.velocity), Part("acceleration", &goal.acceleration)}) {
    const std::string what = std::string("controller: goal: ") + name;
    if (static_cast<std::size_t>(part->size()) != joints.size()) {
      throw std::invalid_argument(what + " has " + std::to_string(part->size()) +
                                  " entries, allowed: " + std::to_string(joints.size()) + ", one for each joint");
    }
    for (Eigen::Index j = 0; j < part->size(); ++j) {
      if (!std::isfinite((*part)[j])) {
        throw std::invalid_argument(what + " of joint '" + joints[static_cast<std::size_t>(j)] + "' is " +
                                    std::to_string((*part)[j]) + ", allowed: finite numbers");
      }
    }
  }
  throw std::invalid_argument("controller: goal: it is not one for arm '" + robot.name() + "'");
}

void refuse_goal(const PoseGoal& goal, const Robot& robot) {
  const std::string what = "controller: goal: the pose goal of frame '" + goal.frame().name + "' ";
  if (!goal.is_for(robot)) {
    throw std::invalid_argument(what + "is made for another robot than '" + robot.name() + "', allowed: one made for it");
  }
  using Part = std::pair<const char*, bool>;
  for (const auto& [name, finite] : {Part("pose", goal.pose.matrix().allFinite()), Part("twist", goal.twist.allFinite()),
                                     Part("rest", goal.settings.rest.allFinite())}) {
    if (!finite) {
      throw std::invalid_argument(what + "has a " + name + " that is not finite, allowed: finite numbers");
    }
  }
  for (const PoseGoal& other : goal.others) {
    refuse_goal(other, robot);
  }
}

/// What is hard to believe in a request; empty where nothing is.
std::string question_of(const Request& request, const Plausibility& plausible) {
  if (const auto* goal = std::get_if<Goal>(&request)) {
    return plausible.question(*goal);
  }
  if (const auto* velocity = std::get_if<VelocityRequest>(&request)) {
    return plausible.question_velocity(velocity->velocity);
  }
  if (const auto* twist = std::get_if<TwistRequest>(&request)) {
    Vector6d asked = twist->twist;
    if (twist->free == TwistFreedom::rotation) {
      asked.tail<3>().setZero();
    }
    return plausible.question_twist(asked);
  }
  return {};
}

}  // namespace

void Controller::Impl::set_goal(std::optional<Goal> goal) {
  if (goal) {
    const Robot& robot = model.arm.robot();
    const JointLimits& limits = robot.limits();
    if (auto* joint = std::get_if<JointGoal>(&*goal);
        joint != nullptr && joint->position.size() == robot.num_coordinates() && joint->position.allFinite()) {
      const Eigen::VectorXd within = limits.nearest_within(joint->position);
      if ((joint->position - within).cwiseAbs().maxCoeff() <= JointLimits::rounding) {
        joint->position = within;
      }
    }
    const GoalFault fault = check(*goal, robot);
    if (fault == GoalFault::invalid) {
      std::visit([&](const auto& one) { refuse_goal(one, robot); }, *goal);
    }
    if (fault == GoalFault::outside_limits) {
      const Eigen::VectorXd& position = std::get<JointGoal>(*goal).position;
      for (Eigen::Index j = 0; j < position.size(); ++j) {
        const double lower = limits.lower[j], upper = limits.upper[j];
        if (position[j] < lower - JointLimits::rounding || position[j] > upper + JointLimits::rounding) {
          throw std::invalid_argument("controller: goal: joint '" + robot.coordinate_names()[static_cast<std::size_t>(j)] +
                                      "' is " + std::to_string(position[j]) + ", allowed: " + std::to_string(lower) + " to " +
                                      std::to_string(upper) + (robot.is_prismatic(static_cast<int>(j)) ? " m" : " rad") +
                                      Plausibility::hint(robot, position));
        }
      }
    }
    if (auto* pose = std::get_if<PoseGoal>(&*goal)) {
      const auto set_stiffness = [&](PoseGoal& one) {
        one.settings.position_stiffness = pose_position_share * model.settings.barriers.stiffness;
        one.settings.orientation_stiffness = pose_rotation_share * model.settings.barriers.stiffness;
      };
      set_stiffness(*pose);
      std::for_each(pose->others.begin(), pose->others.end(), set_stiffness);
    }
  }
  put(goal ? Request(std::move(*goal)) : Request());
}

void Controller::Impl::set_velocity(const Eigen::VectorXd& v) {
  if (v.size() != model.arm.num_coordinates()) {
    throw std::invalid_argument("controller: velocity has " + std::to_string(v.size()) +
                                " entries, allowed: " + std::to_string(model.arm.num_coordinates()) + ", one for each joint");
  }
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    if (!std::isfinite(v[j])) {
      throw std::invalid_argument("controller: velocity of joint '" +
                                  model.arm.robot().coordinate_names()[static_cast<std::size_t>(j)] + "' is " +
                                  std::to_string(v[j]) + ", allowed: finite numbers");
    }
  }
  put(VelocityRequest{v});
}

void Controller::Impl::set_twist(const std::string& frame, const Vector6d& twist, bool local, TwistFreedom free) {
  if (!(free == TwistFreedom::rotation ? twist.head<3>().allFinite() : twist.allFinite())) {
    std::string numbers;
    for (const double number : twist) {
      numbers += (numbers.empty() ? "" : ", ") + std::to_string(number);
    }
    throw std::invalid_argument("controller: twist of frame '" + frame + "' is (" + numbers + "), allowed: finite numbers");
  }
  put(TwistRequest{moved_frame(model.arm.robot(), frame, "controller: twist"), twist, local, free});
}

void Controller::Impl::set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times, TrajectoryBehaviour behaviour) {
  TrajectoryRequest request{JointTrajectory(model.arm.robot(), q, times, model.usable.velocity, model.usable.acceleration),
                            behaviour, std::make_shared<const TrajectorySamples>(TrajectorySamples{q, times})};
  put(std::move(request), model.plausible.question_trajectory(q, times));
}

void Controller::Impl::put(Request request, std::string question) {
  if (question.empty()) {
    question = question_of(request, model.plausible);
  }
  board_.put(std::move(request), std::move(question));
}

}  // namespace sidestep
