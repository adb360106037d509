#include "sidestep/constraints/safety_settings.hpp"

namespace sidestep {

template <>
const std::vector<Field<SafetySettings>>& fields() {
  using S = SafetySettings;
  static const std::vector<Field<S>> all{
      {"margin", &S::margin, "m", 0.0, 0.5,
       "clearance that every command keeps: covers tracking error, delay and noise of points"},
      {"rate", &S::rate, "1/s", 0.5, 200.0, "how quickly a clearance may close on its margin: larger comes close quicker"},
      {"braking_fraction", &S::braking_fraction, "-", 0.05, 1.0, "share of the hardest deceleration that is counted on"},
      {"correction", &S::correction, "-", 0.01, 1.0, "share of an excess of closing speed that one period takes away"},
      {"max_rows", &S::max_rows, "-", 1.0, 256.0, "clearances that bound one command: the most critical ones"},
  };
  return all;
}

void SafetySettings::validate() const { check_fields("safety: ", *this); }

}  // namespace sidestep
