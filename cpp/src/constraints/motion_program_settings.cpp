#include <stdexcept>
#include <string>

#include "../math/settings.hpp"
#include "sidestep/constraints/motion_program.hpp"

namespace sidestep {
namespace {

void check_weight(const Eigen::VectorXd& weight, const char* setting, int num, bool zero_allowed) {
  const std::string owner = std::string("torque controller: ") + setting;
  if (weight.size() != 1 && weight.size() != num) {
    throw std::invalid_argument(owner + " has " + std::to_string(weight.size()) + " entries, allowed are 1 or " +
                                std::to_string(num));
  }
  for (const double w : weight) {
    if (!(w > 0.0 || (zero_allowed && w == 0.0)) || w == infinity) {
      throw std::invalid_argument(owner + " is " + std::to_string(w) + ", must be finite and " +
                                  (zero_allowed ? ">= 0" : "positive"));
    }
  }
}

}  // namespace

void MotionProgramSettings::validate(const Robot& robot) const {
  const int nv = robot.num_coordinates();
  require_positive(period, "motion program: period");
  check_weight(tracking_weight, "tracking_weight", nv, false);
  check_weight(torque_weight, "torque_weight", nv, true);
  require_positive(slack_weight, "motion program: slack_weight");
  require(velocity_overrun >= 1.0 && velocity_overrun < infinity, "motion program: velocity_overrun", velocity_overrun,
          "finite and >= 1");
  require(acceleration_overrun >= 1.0 && acceleration_overrun < infinity, "motion program: acceleration_overrun",
          acceleration_overrun, "finite and >= 1");
  safety.validate();
  require_positive(stop_time, "motion program: stop_time");
  require_positive(stop_damping, "motion program: stop_damping");
  require(position_margin >= 0.0, "motion program: position_margin", position_margin, ">= 0");
  for (int i = 0; i < nv; ++i) {
    const double width = robot.limits().upper[i] - robot.limits().lower[i];
    if (!(2.0 * position_margin < width) && position_margin > 0.0) {
      throw std::invalid_argument("motion program: position_margin is " + std::to_string(position_margin) +
                                  ", must be less than half of the range " + std::to_string(width) + " of joint '" +
                                  robot.coordinate_names()[static_cast<std::size_t>(i)] + "'");
    }
  }
}

}  // namespace sidestep
