#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <variant>

#include "sidestep/attractor/goal.hpp"
#include "sidestep/controller/controller.hpp"
#include "sidestep/controller/joint_trajectory.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

struct VelocityRequest {
  Eigen::VectorXd velocity;  // (nv) [rad/s | m/s]
};
struct TwistRequest {
  Frame frame;
  Vector6d twist;
  bool local;
  TwistFreedom free;
};
struct TrajectoryRequest {
  JointTrajectory path;
  TrajectoryBehaviour behaviour;
  std::shared_ptr<const TrajectorySamples> samples;  // as they were given
};

/// What the arm is to do, as it was set last.
using Request = std::variant<std::monostate, Goal, VelocityRequest, TwistRequest, TrajectoryRequest>;

/// With its number: 0 is none.
struct NumberedRequest {
  std::uint64_t number = 0;
  Request request;
};

}  // namespace sidestep
