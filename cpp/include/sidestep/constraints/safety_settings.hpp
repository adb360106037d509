#pragma once

#include <vector>

#include "sidestep/math/fields.hpp"

namespace sidestep {

struct SafetySettings {
  /// Clearance that every command keeps [m], or `Clearances::margins` if smaller. Covers model errors: the mean over points is
  /// high by up to its temperature (2 mm by default), tracking error, one period of delay, and 1.5/rate times the unknown speed
  /// of obstacles: 5 mm hold off an approach of up to 0.06 m/s.
  double margin = 0.005;
  /// Largest closing speed of a slow arm per distance left, γ [1/s]. Larger approaches faster and reacts more to noise; γT must stay well
  /// below 1.
  double rate = 20.0;
  /// Deceleration A that braking relies on, as a share of the largest that the joint limits allow along ∇h [-]. The rest serves the
  /// curvature c, other clearances and limits, and joints that cannot give all at once.
  double braking_fraction = 0.5;
  /// Share of an excessive closing speed that is removed in one period [-].
  double correction = 0.5;
  /// Largest number of rows. If more clearances are active, those with the smallest s − u/γ are kept [-].
  int max_rows = 32;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};
template <>
const std::vector<Field<SafetySettings>>& fields();

}  // namespace sidestep
