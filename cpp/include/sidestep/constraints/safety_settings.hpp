#pragma once

#include <vector>

#include "sidestep/math/fields.hpp"

namespace sidestep {

struct SafetySettings {
  /// Clearance that is kept [m]. Covers what the model does not see: the reduction over points is high by up to its
  /// temperature (2 mm by default), tracking error, one period of delay, and 1.5/rate times what obstacles move without
  /// saying so: 5 mm hold off what comes by up to 0.06 m/s. `Clearances::margins` where they are less.
  double margin = 0.005;
  /// γ [1/s] of a slow arm. Larger lets it come close quicker and reacts more to noise; γT must stay well below 1.
  double rate = 20.0;
  /// A over the largest deceleration that the joint limits allow in the direction of ∇h [-]. What is left serves the
  /// curvature c, other clearances and limits, and joints that cannot give all at once.
  double braking_fraction = 0.5;
  /// Fraction of an excess of closing speed that is taken away per period [-].
  double correction = 0.5;
  /// When more clearances are active, those are kept of which s − u/γ is smallest [-].
  int max_rows = 32;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};
template <>
const std::vector<Field<SafetySettings>>& fields();

}  // namespace sidestep
