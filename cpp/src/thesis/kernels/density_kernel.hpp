#pragma once

#include "../../math/kernels/most_lanes.hpp"

// The inner loop of CollisionDensity, once per instruction set. Plain arrays only, see clearance_kernel.hpp.
namespace sidestep::kernels {

/// Gaussians side by side, each in the frame of its link. Symmetric matrices are kept as xx, yy, zz, xy, xz, yz. Where
/// there are fewer than lanes, the last have no weight.
struct GaussianBlock {
  int num = 0;
  int joints[most_lanes] = {};  // of the links
  alignas(64) double mean[3][most_lanes] = {};
  double precision[6][most_lanes] = {}, scale[most_lanes] = {};  // of points without radius: scale · exp(−½ eᵀ P e)
  double weight[most_lanes] = {};
  double variances[3][most_lanes];            // eigenvalues of the covariance, 1 in unused lanes,
  double projections[3][6][most_lanes] = {};  // and a aᵀ of the unit vectors a along them

  GaussianBlock() noexcept {
    for (auto& axis : variances) {
      for (double& variance : axis) {
        variance = 1.0;
      }
    }
  }
};

/// Points, three numbers after three. `velocities` is null where all are at rest.
struct DensityPoints {
  int num;
  double weight;  // of each
  const double *positions, *radii, *velocities;
};

/// Weighted sums over the points of the density and its second time derivative, lane by lane; and the wrench of every
/// Gaussian on its link about the world origin.
struct DensitySums {
  alignas(64) double value[most_lanes], curvature[most_lanes];
  double force[3][most_lanes], moment[3][most_lanes];
};

/// Adds to value and curvature, and writes the wrenches. `links`: of every lane, KinematicState::Link::numbers.
using AddDensity = void (*)(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                            DensitySums& sums) noexcept;

void add_density_baseline(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                          DensitySums& sums) noexcept;
void add_density_avx2(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                      DensitySums& sums) noexcept;
void add_density_avx512(const GaussianBlock& gaussians, const double* const* links, const DensityPoints& points,
                        DensitySums& sums) noexcept;

}  // namespace sidestep::kernels
