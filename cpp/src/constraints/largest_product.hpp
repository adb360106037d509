#pragma once

#include <Eigen/Core>

namespace sidestep {

/// The largest direction·a with lower <= a <= upper; a joint that does not count may be without limits.
template <class Direction, class Lower, class Upper>
double largest_product(const Direction& direction, const Lower& lower, const Upper& upper) noexcept {
  double sum = 0.0;
  for (Eigen::Index j = 0; j < direction.size(); ++j) {
    const double d = direction[j];
    if (d != 0.0) {
      sum += d > 0.0 ? d * upper[j] : d * lower[j];
    }
  }
  return sum;
}

}  // namespace sidestep
