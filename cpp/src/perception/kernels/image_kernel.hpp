#pragma once

// The loops over the pixels of an image, once per instruction set. Plain arrays only, see clearance_kernel.hpp.
namespace sidestep::kernels {

/// An ellipsoid as the rays (x, y, 1) meet it, α z² - 2 β z + γ <= 0 inside:
/// α = a0 x² + a1 y² + a2 xy + a3 x + a4 y + a5, β = b0 x + b1 y + b2. Depths have the noise constant + quadratic z².
struct RayEllipsoid {
  float a[6], b[3], gamma;
  float constant, quadratic;
  bool hides;  ///< It hides what is behind: the camera is not inside.
};

/// A rotation, by rows, and a translation.
struct Placement {
  float R[9], t[3];
};

/// A cube of cells around `centre`.
struct CellCube {
  float centre[3], half, per_metre;
  int side, begin;
};

/// When a pixel rests, see SteadyDepth. A depth z has the noise sigma = constant + quadratic z².
struct SteadyRule {
  float constant, quadratic;
  float jump;           ///< difference from the mean [sigma] that is another surface
  float drift;          ///< lasting difference [sigma] that is a surface that moves
  float most;           ///< images over which a mean is taken
  float least;          ///< images without a jump or a drift after which a pixel rests
  unsigned char shows;  ///< label of the pixels that have a mean
};

struct ImageKernel {
  /// Lowers `front` to the depth at which rays enter the ellipsoid, and sets `arm` to 1 where z is inside but for noise.
  void (*mark)(const RayEllipsoid& ellipsoid, const float* x, const float* y, const float* z, int count, float* front,
               float* arm);
  /// Points of depths along rays.
  void (*place)(const Placement& placement, const float* x, const float* y, const float* z, int count, float* px, float* py,
                float* pz);
  /// Numbers of the cells of points; those outside of the cube stay as they are.
  void (*cells)(const CellCube& cube, const float* x, const float* y, const float* z, int count, int* cells);
  /// Adds 1 to `support` where a neighbour has the same depth within the tolerance, else to `others` where it has one.
  void (*compare)(const float* z, const float* neighbour, const float* tolerance, int count, float* support, float* others);
  /// Takes depths into the means of their pixels: over `images`, below 0 where the last depth jumped, with lasting differences `drift`
  /// [sigma]. `steady`: the mean of those that rest, else the depth.
  void (*steady)(const SteadyRule& rule, const float* z, const unsigned char* label, int count, float* mean, float* images,
                 float* drift, float* steady);
};

ImageKernel image_kernel_baseline() noexcept;
ImageKernel image_kernel_avx2() noexcept;
ImageKernel image_kernel_avx512() noexcept;

}  // namespace sidestep::kernels
