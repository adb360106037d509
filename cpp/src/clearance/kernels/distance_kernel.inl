// Included by one file per instruction set, after distance_kernel.hpp and intrinsics.hpp. Defines two functions in an
// anonymous namespace: loops over `most_balls` floats that the compiler puts side by side in the registers it has.

namespace sidestep::kernels {
namespace {

constexpr int refinements = 2;          // Newton steps: they leave a median error of 10⁻⁴ of the distance for axes 1 : 6.
constexpr float inside = -0.999f;       // Smallest t as a share of the least squared axis: t stays above its pole.
constexpr float tiny = 1e-20f;          // Divisor that stands for zero.
constexpr float centre_offset = 1e-6f;  // Offset that stands for the centre, which has no nearest direction [m].

/// `count` numbers side by side.
template <class T, int count>
struct SideBySide {
  typedef T Type __attribute__((vector_size(sizeof(T) * count)));
};
template <int count>
using Floats = typename SideBySide<float, count>::Type;

template <class F>
inline constexpr int lanes = sizeof(F) / sizeof(float);

/// Numbers from an array less one that is taken off in double precision.
template <class F>
inline F load(const double* from, double less = 0.0) noexcept {
  typename SideBySide<double, lanes<F>>::Type x;
  __builtin_memcpy(&x, from, sizeof x);
  return __builtin_convertvector(x - less, F);
}

template <class F>
inline F all(float x) noexcept {
  return x - F{};
}
template <class F>
inline F larger(F a, F b) noexcept {
  return a > b ? a : b;
}
template <class F>
inline F root(F x) noexcept {
  F y;
  for (int i = 0; i < lanes<F>; ++i) {
    y[i] = __builtin_sqrtf(x[i]);
  }
  return y;
}

/// Which x are below the limit, as bits.
template <class F>
inline unsigned below(F x, float limit) noexcept {
#if defined(__AVX512F__)
  if constexpr (lanes<F> == 16) {
    return _mm512_cmp_ps_mask((__m512)x, _mm512_set1_ps(limit), _CMP_LT_OQ);
  }
#endif
#if defined(__AVX2__)
  if constexpr (lanes<F> == 8) {
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps((__m256)x, _mm256_set1_ps(limit), _CMP_LT_OQ)));
  }
#endif
  unsigned bits = 0;
#if defined(__aarch64__)
  constexpr uint32x4_t bit = {1, 2, 4, 8};
  for (int i = 0; i < lanes<F>; i += 4) {
    float32x4_t four;
    __builtin_memcpy(&four, reinterpret_cast<const char*>(&x) + sizeof(float) * i, sizeof four);
    bits |= vaddvq_u32(vandq_u32(vcltq_f32(four, vdupq_n_f32(limit)), bit)) << i;
  }
  return bits;
#endif
  const typename SideBySide<int, lanes<F>>::Type is = x < limit;
  for (int i = 0; i < lanes<F>; ++i) {
    bits |= static_cast<unsigned>(is[i] & 1) << i;
  }
  return bits;
}

/// For every direction n the supporting plane gives a lower bound of the signed distance of e, and the best of them is
/// the distance:
///
///     d(e) = max over n of (n·e − √(nᵀ S n)) / |n|.
///
/// The best is among n_i = e_i / (a_i² + t), at the root of |a_i n_i| = 1 (the secular equation). t = 0 gives the
/// first-order distance; Newton's steps on 1/|a_i n_i| − 1, which is concave, come to the root from below.
unsigned distances_to_balls(const PlacedEllipsoid& ellipsoid, const Balls& balls, int first, int count, double limit,
                            float* distances) noexcept {
  using Floats = Floats<most_balls>;
  const Floats offset[3] = {load<Floats>(balls.x + first, ellipsoid.centre[0]),
                            load<Floats>(balls.y + first, ellipsoid.centre[1]),
                            load<Floats>(balls.z + first, ellipsoid.centre[2])};
  const Floats radius = load<Floats>(balls.radius + first);
  Floats e[3];
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
    e[0] = squared < centre_offset * centre_offset ? all<Floats>(centre_offset) : e[0];
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
        t = larger(t, all<Floats>(inside * squares[0]));
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
template <class Floats>
unsigned distances_to_boxes(const PlacedEllipsoid& ellipsoid, const Boxes& boxes, int first, int count, float least,
                            float* distances) noexcept {
  const double* const middles[3] = {boxes.x, boxes.y, boxes.z};
  const double* const halves[3] = {boxes.half_x, boxes.half_y, boxes.half_z};
  const Floats radius = load<Floats>(boxes.radius + first);
  Floats low[3], high[3], nearest[3], squared{};
  for (int k = 0; k < 3; ++k) {
    const Floats middle = load<Floats>(middles[k] + first, ellipsoid.centre[k]), half = load<Floats>(halves[k] + first);
    low[k] = middle - half;
    high[k] = middle + half;
    nearest[k] = larger(low[k], all<Floats>(0.0f)) - larger(-high[k], all<Floats>(0.0f));
    squared += nearest[k] * nearest[k];
  }
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
    e[0] = squared < centre_offset * centre_offset ? all<Floats>(centre_offset) : e[0];
    // One step of Newton from infinity.
    const Floats t = larger(root(second) - fourth / larger(second, all<Floats>(tiny)), all<Floats>(0.0f));
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

unsigned distances_to_boxes(const PlacedEllipsoid& ellipsoid, const Boxes& boxes, int first, int count, double limit,
                            float* distances) noexcept {
  constexpr int half = most_balls / 2;  // Balls below a node of the tree; the top of it has more.
  const float least = static_cast<float>(limit);
  if (count <= half) {
    return distances_to_boxes<Floats<half>>(ellipsoid, boxes, first, count, least, distances);
  }
  return distances_to_boxes<Floats<most_balls>>(ellipsoid, boxes, first, count, least, distances);
}

}  // namespace
}  // namespace sidestep::kernels
