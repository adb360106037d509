#include "sidestep/math/fields.hpp"

#include <iomanip>
#include <sstream>
#include <stdexcept>

namespace sidestep {

void check_range(const std::string& setting, double value, double least, double most, const char* unit) {
  if (!(value >= least && value <= most)) {
    const std::string of = std::string(unit) == "-" ? "" : std::string(" ") + unit;
    std::ostringstream text;
    text << std::setprecision(15);
    text << setting << " is " << value << of << ", allowed: " << least << " to " << most << of;
    throw std::invalid_argument(text.str());
  }
}

}  // namespace sidestep
