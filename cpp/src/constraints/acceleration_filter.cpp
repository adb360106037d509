#include "sidestep/constraints/acceleration_filter.hpp"

#include <limits>
#include <utility>

namespace sidestep {
namespace {

Robot of_unlimited_effort(const Robot& robot) {
  JointLimits limits = robot.limits();
  limits.effort.setConstant(std::numeric_limits<double>::infinity());
  limits.effort_rate = limits.effort;
  return Robot(robot.name(), robot.joints(), robot.frames(), robot.coordinate_names(), std::move(limits));
}

TorqueControllerSettings controller_settings(const AccelerationFilterSettings& settings) {
  TorqueControllerSettings result;
  result.period = settings.period;
  result.position_margin = settings.position_margin;
  result.stop_time = settings.stop_time;
  result.safety = settings.safety;
  result.max_speed_rows = settings.max_speed_rows;
  result.torque_weight.setZero();
  result.hard_bounds = true;
  return result;
}

}  // namespace

AccelerationFilter::AccelerationFilter(const Robot& robot, AccelerationFilterSettings settings)
    : unit_mass_(Eigen::MatrixXd::Identity(robot.num_coordinates(), robot.num_coordinates())),
      no_bias_(Eigen::VectorXd::Zero(robot.num_coordinates())),
      controller_(of_unlimited_effort(robot), controller_settings(settings)) {}

}  // namespace sidestep
