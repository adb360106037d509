#pragma once

namespace sidestep {

/// Balls as structure of arrays [m].
struct Balls {
  const double *x, *y, *z, *radius;
};

/// Boxes along the axes, around their centres, and what is within `radius` of them, as structure of arrays [m].
struct Boxes {
  const double *x, *y, *z;
  const double *half_x, *half_y, *half_z;
  const double* radius;
};

}  // namespace sidestep
