#include "sidestep/loop/driver.hpp"

#include <stdexcept>

#include "../math/settings.hpp"

namespace sidestep {

const char* to_string(ControllerSettings::Output output) noexcept {
  switch (output) {
    case ControllerSettings::Output::automatic: return "automatic";
    case ControllerSettings::Output::torque: return "torque";
    case ControllerSettings::Output::acceleration: return "acceleration";
    case ControllerSettings::Output::velocity: return "velocity";
    case ControllerSettings::Output::position: break;
  }
  return "position";
}

void RobotDescription::validate() const {
  require(period > 0.0 && period <= 1.0, ("driver: period of robot '" + name + "'").c_str(), period,
          "greater than 0 and at most 1 [s]");
  if (outputs.empty()) {
    throw std::invalid_argument("driver: robot '" + name +
                                "' takes no output; name torque, acceleration, velocity or position");
  }
}

}  // namespace sidestep
