// Included by one file per instruction set, after distance_kernel.hpp and <immintrin.h> where there is one. Defines
// distances_to in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "../../embedding/kernels/lanes.inl"

constexpr int refinements = 2;          // a median error of 10⁻⁴ of the distance for axes 1 : 6
constexpr double inside = -0.999;       // of the least square: t stays above its pole
constexpr double centre_offset = 1e-9;  // [m] stands for the centre, where no direction is the nearest

inline Lanes larger(Lanes a, Lanes b) noexcept { return a > b ? a : b; }

/// For every direction n the supporting plane gives a lower bound of the signed distance of e, and the best of them is
/// the distance:
///
///     d(e) = max over n of (n·e − √(nᵀ S n)) / |n|.
///
/// The best is among n_i = e_i / (a_i² + t), at the root of |a_i n_i| = 1 (the secular equation). t = 0 gives the first-order
/// distance; Newton's steps on 1/|a_i n_i| − 1, which is concave, come to the root from below.
unsigned distances_to(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                      double* distances) noexcept {
  const double* A = ellipsoid.axes;
  const double* squares = ellipsoid.squares;
  const double precisions[3] = {1.0 / squares[0], 1.0 / squares[1], 1.0 / squares[2]};
  unsigned near = 0;
  for (int at = 0; at < count; at += width) {
    const int n = first + at;
    const Lanes x = load(balls.centre[0] + n) - ellipsoid.centre[0];
    const Lanes y = load(balls.centre[1] + n) - ellipsoid.centre[1];
    const Lanes z = load(balls.centre[2] + n) - ellipsoid.centre[2];
    const Lanes radius = load(balls.radius + n);
    Lanes e[3], normal[3];
    for (int i = 0; i < 3; ++i) {
      e[i] = A[3 * i] * x + A[3 * i + 1] * y + A[3 * i + 2] * z;
    }
    const Lanes squared = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    e[0] = squared < centre_offset * centre_offset ? all(centre_offset) : e[0];
    Lanes along{}, length{};
    for (int i = 0; i < 3; ++i) {
      normal[i] = precisions[i] * e[i];
      along += e[i] * normal[i];
      length += normal[i] * normal[i];
    }
    Lanes support = root(along);
    Lanes distance = (along - support) / root(length);
    if (below(distance - radius, all(limit)) != 0) {
      // From infinity the first step is to |a e| − Σ a⁴e² / Σ a²e²: the better of the two starts counts.
      Lanes second{}, fourth{};
      for (int i = 0; i < 3; ++i) {
        const Lanes a2e2 = squares[i] * e[i] * e[i];
        second += a2e2;
        fourth += squares[i] * a2e2;
      }
      Lanes t = larger(along * (support - 1.0) / length, root(second) - fourth / second);
      for (int k = 0; k < refinements; ++k) {
        t = larger(t, all(inside * squares[0]));
        Lanes square{}, slope{};
        along = length = Lanes{};
        for (int i = 0; i < 3; ++i) {
          const Lanes weight = 1.0 / (t + squares[i]);
          normal[i] = e[i] * weight;
          along += e[i] * normal[i];
          length += normal[i] * normal[i];
          const Lanes share = squares[i] * normal[i] * normal[i];
          square += share;
          slope += share * weight;
        }
        support = root(square);
        distance = larger(distance, (along - support) / root(length));
        t += square * (support - 1.0) / slope;
      }
    }
    distance -= radius;
    store(distances + at, distance);
    near |= below(distance, all(limit)) << at;
  }
  return near & ((2u << (count - 1)) - 1u);
}

}  // namespace
}  // namespace sidestep::kernels
