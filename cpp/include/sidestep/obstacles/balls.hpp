#pragma once

namespace sidestep {

/// Balls as structure of arrays [m].
struct Balls {
  const double *x, *y, *z, *radius;
};

}  // namespace sidestep
