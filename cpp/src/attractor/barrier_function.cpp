#include "sidestep/attractor/barrier_function.hpp"

#include <stdexcept>
#include <string>

namespace sidestep {

void BarrierFunction::validate(const char* owner) const {
  const auto require = [owner](bool good, const char* setting, double value, const char* allowed) {
    if (!good) {
      throw std::invalid_argument(std::string(owner) + ": " + setting + " is " + std::to_string(value) + ", must be " +
                                  allowed);
    }
  };
  require(activation > 0.0 && std::isfinite(activation), "activation", activation, "positive and finite");
  require(strength > 0.0 && std::isfinite(strength), "strength", strength, "positive and finite");
  require(power >= 2.0 && std::isfinite(power), "power", power, "at least 2 and finite");
  require(floor > 0.0 && floor < activation, "floor", floor, "positive and below the activation distance");
}

}  // namespace sidestep
