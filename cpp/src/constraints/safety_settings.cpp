#include "sidestep/constraints/safety_settings.hpp"

namespace sidestep {

template <>
const std::vector<Field<SafetySettings>>& fields() {
  using S = SafetySettings;
  static const std::vector<Field<S>> all{
      {"margin", &S::margin, "m", 0.0, 0.5,
       "clearance that every command keeps: larger allows for more tracking error, delay and noise"},
      {"rate", &S::rate, "1/s", 0.5, 200.0,
       "largest closing speed per distance left to the margin: larger approaches faster, but reacts more to noise"},
      {"braking_fraction", &S::braking_fraction, "-", 0.05, 1.0,
       "share of the largest possible deceleration that braking relies on: larger brakes later"},
      {"correction", &S::correction, "-", 0.01, 1.0,
       "share of an excessive closing speed that is removed in one period: larger reacts harder"},
      {"max_rows", &S::max_rows, "-", 1.0, 256.0,
       "largest number of clearances that constrain one command: the most critical ones"},
  };
  return all;
}

void SafetySettings::validate() const { check_fields("safety: ", *this); }

}  // namespace sidestep
