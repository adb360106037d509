// Included by one file per instruction set, after distance_kernel.hpp. Defines two functions in an anonymous namespace: loops
// over `most_balls` floats that the compiler puts side by side in the registers it has.

namespace sidestep::kernels {
namespace {

constexpr int refinements = 2;           // a median error of 10⁻⁴ of the distance for axes 1 : 6
constexpr float inside = -0.999f;        // of the least square: t stays above its pole
constexpr float tiny = 1e-20f;           // in place of zero, below a fraction line
constexpr float centre_offset = 1e-6f;   // [m] stands for the centre, where no direction is the nearest

typedef float Floats __attribute__((vector_size(4 * most_balls)));
typedef int Ints __attribute__((vector_size(4 * most_balls)));

inline Floats all(float x) noexcept { return x - Floats{}; }
inline Floats larger(Floats a, Floats b) noexcept { return a > b ? a : b; }
inline Floats root(Floats x) noexcept {
  Floats y;
  for (int i = 0; i < most_balls; ++i) {
    y[i] = __builtin_sqrtf(x[i]);
  }
  return y;
}

/// Which x are below the limit, as bits.
inline unsigned below(Floats x, float limit) noexcept {
#if defined(__AVX512F__)
  return _mm512_cmp_ps_mask((__m512)x, _mm512_set1_ps(limit), _CMP_LT_OQ);
#else
  const Ints is = x < limit;
  unsigned bits = 0;
  for (int i = 0; i < most_balls; ++i) {
    bits |= static_cast<unsigned>(is[i] & 1) << i;
  }
  return bits;
#endif
}

/// For every direction n the supporting plane gives a lower bound of the signed distance of e, and the best of them is
/// the distance:
///
///     d(e) = max over n of (n·e − √(nᵀ S n)) / |n|.
///
/// The best is among n_i = e_i / (a_i² + t), at the root of |a_i n_i| = 1 (the secular equation). t = 0 gives the first-order
/// distance; Newton's steps on 1/|a_i n_i| − 1, which is concave, come to the root from below.
unsigned distances_to_balls(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                      float* distances) noexcept {
  Floats offset[3], radius, e[3];
  for (int i = 0; i < most_balls; ++i) {
    offset[0][i] = static_cast<float>(balls.x[first + i] - ellipsoid.centre[0]);
    offset[1][i] = static_cast<float>(balls.y[first + i] - ellipsoid.centre[1]);
    offset[2][i] = static_cast<float>(balls.z[first + i] - ellipsoid.centre[2]);
    radius[i] = static_cast<float>(balls.radius[first + i]);
  }
  float squares[3];
  for (int i = 0; i < 3; ++i) {
    const double* A = ellipsoid.axes + 3 * i;
    e[i] = static_cast<float>(A[0]) * offset[0] + static_cast<float>(A[1]) * offset[1] + static_cast<float>(A[2]) * offset[2];
    squares[i] = static_cast<float>(ellipsoid.squares[i]);
  }
  const float least = static_cast<float>(limit);
  const unsigned asked = (2u << (count - 1)) - 1u;
  const Floats squared = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
  // Outside the ball around it.
  Floats distance = root(squared) - static_cast<float>(ellipsoid.extent);
  unsigned near = below(distance - radius, least) & asked;
  if (near != 0 && ellipsoid.extent > 0.0) {
    e[0] = squared < centre_offset * centre_offset ? all(centre_offset) : e[0];
    Floats along{}, length{}, second{}, fourth{};
    for (int i = 0; i < 3; ++i) {
      const Floats normal = (1.0f / squares[i]) * e[i];
      along += e[i] * normal;
      length += normal * normal;
      const Floats a2e2 = squares[i] * e[i] * e[i];
      second += a2e2;
      fourth += squares[i] * a2e2;
    }
    Floats support = root(along);
    distance = larger((along - support) / root(length), distance);
    near = below(distance - radius, least) & asked;
    if (near != 0) {
      // From infinity the first step is to |a e| − Σ a⁴e² / Σ a²e²: the better of the two starts counts.
      Floats t = larger(along * (support - 1.0f) / length, root(second) - fourth / second);
      for (int k = 0; k < refinements; ++k) {
        t = larger(t, all(inside * squares[0]));
        Floats square{}, slope{};
        along = length = Floats{};
        for (int i = 0; i < 3; ++i) {
          const Floats weight = 1.0f / (t + squares[i]);
          const Floats normal = e[i] * weight;
          along += e[i] * normal;
          length += normal * normal;
          const Floats share = squares[i] * normal * normal;
          square += share;
          slope += share * weight;
        }
        support = root(square);
        distance = larger((along - support) / root(length), distance);
        t += square * (support - 1.0f) / slope;
      }
      near = below(distance - radius, least) & asked;
    }
  }
  distance -= radius;
  __builtin_memcpy(distances, &distance, sizeof distance);
  return near;
}

/// Every direction n gives a lower bound for a box too, of which the nearest corner counts:
///
///     d ≥ (min over the box of n·x − √(nᵀ S n)) / |n|.
///
/// n is that of the point of the box that is nearest to the centre, where the first steps of the search above lead.
unsigned distances_to_boxes(const PlacedEllipsoid& ellipsoid, const Boxes& boxes, int first, int count, double limit,
                            float* distances) noexcept {
  const double* const middles[3] = {boxes.x, boxes.y, boxes.z};
  const double* const halves[3] = {boxes.half_x, boxes.half_y, boxes.half_z};
  Floats low[3], high[3], nearest[3], radius, squared{};
  for (int i = 0; i < most_balls; ++i) {
    radius[i] = static_cast<float>(boxes.radius[first + i]);
  }
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < most_balls; ++i) {
      const double middle = middles[k][first + i] - ellipsoid.centre[k], half = halves[k][first + i];
      low[k][i] = static_cast<float>(middle - half);
      high[k][i] = static_cast<float>(middle + half);
    }
    nearest[k] = larger(low[k], all(0.0f)) - larger(-high[k], all(0.0f));
    squared += nearest[k] * nearest[k];
  }
  const float least = static_cast<float>(limit);
  const unsigned asked = (2u << (count - 1)) - 1u;
  Floats distance = root(squared) - static_cast<float>(ellipsoid.extent);
  unsigned near = below(distance - radius, least) & asked;
  if (near != 0 && ellipsoid.extent > 0.0) {
    const double* A = ellipsoid.axes;
    Floats e[3], second{}, fourth{};
    for (int i = 0; i < 3; ++i) {
      const float a2 = static_cast<float>(ellipsoid.squares[i]);
      e[i] = static_cast<float>(A[3 * i]) * nearest[0] + static_cast<float>(A[3 * i + 1]) * nearest[1] +
             static_cast<float>(A[3 * i + 2]) * nearest[2];
      const Floats a2e2 = a2 * e[i] * e[i];
      second += a2e2;
      fourth += a2 * a2e2;
    }
    e[0] = squared < centre_offset * centre_offset ? all(centre_offset) : e[0];
    // One step of Newton from infinity.
    const Floats t = larger(root(second) - fourth / larger(second, all(tiny)), all(0.0f));
    Floats n[3], length{}, square{};
    for (int i = 0; i < 3; ++i) {
      const float a2 = static_cast<float>(ellipsoid.squares[i]);
      n[i] = e[i] / (t + a2);
      length += n[i] * n[i];
      square += a2 * n[i] * n[i];
    }
    Floats along{};
    for (int k = 0; k < 3; ++k) {
      const Floats n_k =
          static_cast<float>(A[k]) * n[0] + static_cast<float>(A[3 + k]) * n[1] + static_cast<float>(A[6 + k]) * n[2];
      along += n_k > 0.0f ? n_k * low[k] : n_k * high[k];
    }
    distance = larger((along - root(square)) / root(length), distance);
    near = below(distance - radius, least) & asked;
  }
  distance -= radius;
  __builtin_memcpy(distances, &distance, sizeof distance);
  return near;
}

}  // namespace
}  // namespace sidestep::kernels
