// For every processor of the architecture.
#include "distance_kernel.hpp"

#include "distance_kernel.inl"

namespace sidestep::kernels {

unsigned distances_baseline(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                      float* distances) noexcept {
  return distances_to(ellipsoid, balls, first, count, limit, distances);
}

}  // namespace sidestep::kernels
