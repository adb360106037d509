#include "controller_requests.hpp"

#include <utility>

namespace sidestep::link {
namespace {

PoseGoal pose_goal_of(const Robot& robot, const PoseTarget& target) {
  PoseGoalSettings settings;
  settings.position_only = target.position_only;
  settings.rest = target.rest;
  settings.posture_stiffness = target.posture_stiffness;
  if (target.rest.size() != 0) {
    require_size("rest", target.rest.size(), robot.num_coordinates());
  }
  return PoseGoal(robot, target.frame, Eigen::Isometry3d(target.pose), std::move(settings), target.twist);
}

PoseTarget pose_target_of(const PoseGoal& goal) {
  return {goal.frame().name,           goal.pose.matrix(), goal.twist,
          goal.settings.position_only, goal.settings.rest, goal.settings.posture_stiffness};
}

}  // namespace

std::string apply(Controller& controller, const SetJointGoal& request) {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(request.position.size());
  controller.set_goal(JointGoal(request.position, request.velocity.size() == 0 ? rest : request.velocity,
                                request.acceleration.size() == 0 ? rest : request.acceleration));
  return controller.questions().order;
}

std::string apply(Controller& controller, const SetPoseGoal& request) {
  const Arm arm = controller.arm();
  PoseGoal goal = pose_goal_of(arm.robot(), request.targets.front());
  for (std::size_t k = 1; k < request.targets.size(); ++k) {
    goal.add(pose_goal_of(arm.robot(), request.targets[k]));
  }
  controller.set_goal(std::move(goal));
  return controller.questions().order;
}

std::string apply(Controller& controller, const SetVelocity& request) {
  controller.set_velocity(request.velocity);
  return controller.questions().order;
}

std::string apply(Controller& controller, const SetTwist& request) {
  controller.set_twist(request.frame, request.twist, request.local,
                       request.free_rotation ? TwistFreedom::rotation : TwistFreedom::none);
  return controller.questions().order;
}

std::string apply(Controller& controller, const SetTrajectory& request) {
  controller.set_trajectory(request.q, request.times,
                            request.steer ? TrajectoryBehaviour::steer : TrajectoryBehaviour::keep_path);
  return controller.questions().order;
}

std::string apply(Controller& controller, const ClearGoal&) {
  controller.clear_goal();
  return {};
}

std::string apply(Controller& controller, const Restart&) {
  controller.restart();
  return {};
}

std::string apply(Controller& controller, const SetObstacles& request) {
  controller.set_obstacles(request.set.obstacles(), {request.source, request.time, request.valid_for, request.as_given});
  return controller.questions().obstacles;
}

std::string apply(Controller& controller, const AddObstacle& request) {
  controller.add_obstacle(request.set.obstacles(), request.source);
  return controller.questions().obstacles;
}

std::string apply(Controller& controller, const MoveObstacle& request) {
  controller.move_obstacle(request.name, Eigen::Isometry3d(request.pose),
                           {request.source, request.time, request.valid_for, false});
  return controller.questions().obstacles;
}

std::string apply(Controller& controller, const RemoveObstacle& request) {
  controller.remove_obstacle(request.name, request.source);
  return {};
}

std::string apply(Controller& controller, const RemoveObstacles& request) {
  controller.remove_obstacles(request.source);
  return {};
}

std::string apply(Controller& controller, const ExpectObstacles& request) {
  controller.expect_obstacles(request.source);
  return {};
}

SetPoseGoal pose_request(const PoseGoal& goal) {
  SetPoseGoal request{{pose_target_of(goal)}};
  for (const PoseGoal& other : goal.others) {
    request.targets.push_back(pose_target_of(other));
  }
  return request;
}

}  // namespace sidestep::link
