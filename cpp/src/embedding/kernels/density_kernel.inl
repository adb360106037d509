// Included by one file per instruction set, after density_kernel.hpp and <immintrin.h> where there is one. Defines
// add_density in an anonymous namespace.

#include "../../kinematics/kernels/link_numbers.hpp"

namespace sidestep::kernels {
namespace {

#include "lanes.inl"

constexpr double inverse_two_pi_cubed = 1.0 / 248.05021344239853;  // 1/(2π)³
constexpr double least_exponent = -700.0;  // below it a density is no normal number: taken as zero

/// A vector of each lane.
struct Vectors {
  Lanes x, y, z;

  Vectors operator+(const Vectors& o) const noexcept { return {x + o.x, y + o.y, z + o.z}; }
  Vectors operator-(const Vectors& o) const noexcept { return {x - o.x, y - o.y, z - o.z}; }
  Lanes dot(const Vectors& o) const noexcept { return x * o.x + y * o.y + z * o.z; }
};

inline Vectors cross(const Vectors& a, const Vectors& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Vectors all(const double* v) noexcept { return {all(v[0]), all(v[1]), all(v[2])}; }

inline Vectors load(const double (&rows)[3][most_lanes], int first) noexcept {
  return {load(rows[0] + first), load(rows[1] + first), load(rows[2] + first)};
}

inline void store(double (&rows)[3][most_lanes], int first, const Vectors& v) noexcept {
  store(rows[0] + first, v.x);
  store(rows[1] + first, v.y);
  store(rows[2] + first, v.z);
}

#if defined(__AVX2__)
/// Two numbers of every other link.
inline Lanes pairs(const double* const* links, int at) noexcept {
#if defined(__AVX512F__)
  __m512d x = _mm512_castpd128_pd512(_mm_loadu_pd(links[0] + at));
  x = _mm512_insertf64x2(x, _mm_loadu_pd(links[2] + at), 1);
  x = _mm512_insertf64x2(x, _mm_loadu_pd(links[4] + at), 2);
  return _mm512_insertf64x2(x, _mm_loadu_pd(links[6] + at), 3);
#else
  return _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(links[0] + at)), _mm_loadu_pd(links[2] + at), 1);
#endif
}

inline Lanes first_of_pairs(Lanes even, Lanes odd) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_unpacklo_pd(0xff, even, odd);
#else
  return _mm256_unpacklo_pd(even, odd);
#endif
}

inline Lanes second_of_pairs(Lanes even, Lanes odd) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_unpackhi_pd(0xff, even, odd);
#else
  return _mm256_unpackhi_pd(even, odd);
#endif
}
#endif

/// Three numbers of the link of every lane.
inline Vectors gather(const double* const* links, int at) noexcept {
#if defined(__AVX2__)
  // Two at a time: one by one they all have to be shuffled into place.
  const Lanes even = pairs(links, at), odd = pairs(links + 1, at);
  return {first_of_pairs(even, odd), second_of_pairs(even, odd),
          second_of_pairs(pairs(links, at + 1), pairs(links + 1, at + 1))};
#else
  Vectors v;
  for (int i = 0; i < width; ++i) {
    v.x[i] = links[i][at];
    v.y[i] = links[i][at + 1];
    v.z[i] = links[i][at + 2];
  }
  return v;
#endif
}

/// The links of the lanes, from their numbers (see link_numbers.hpp).
struct Links {
  Vectors rotation[3];  // columns
  Vectors position, angular, linear, bias_angular, bias_linear;

  explicit Links(const double* const* links) noexcept
      : rotation{gather(links, 0), gather(links, 3), gather(links, 6)},
        position(gather(links, position_at)),
        angular(gather(links, velocity_at)),
        linear(gather(links, velocity_at + 3)),
        bias_angular(gather(links, bias_at)),
        bias_linear(gather(links, bias_at + 3)) {}

  Vectors from_world(const Vectors& v) const noexcept {
    return {rotation[0].dot(v), rotation[1].dot(v), rotation[2].dot(v)};
  }
  Vectors to_world(const Vectors& v) const noexcept {
    return {rotation[0].x * v.x + rotation[1].x * v.y + rotation[2].x * v.z,
            rotation[0].y * v.x + rotation[1].y * v.y + rotation[2].y * v.z,
            rotation[0].z * v.x + rotation[1].z * v.y + rotation[2].z * v.z};
  }
};

/// scale · exp(−½ eᵀ P e).
struct Peak {
  Lanes xx, yy, zz, xy, xz, yz, scale;

  Peak(const GaussianBlock& g, int first, double radius) noexcept {
    if (!(radius > 0.0)) {
      const auto entry = [&](int i) noexcept { return load(g.precision[i] + first); };
      xx = entry(0), yy = entry(1), zz = entry(2), xy = entry(3), xz = entry(4), yz = entry(5);
      scale = load(g.scale + first);
      return;
    }
    Lanes inverse[3];
    for (int i = 0; i < 3; ++i) {
      inverse[i] = 1.0 / (load(g.variances[i] + first) + radius * radius);
    }
    const auto entry = [&](int i) noexcept {
      return inverse[0] * load(g.projections[0][i] + first) + inverse[1] * load(g.projections[1][i] + first) +
             inverse[2] * load(g.projections[2][i] + first);
    };
    xx = entry(0), yy = entry(1), zz = entry(2), xy = entry(3), xz = entry(4), yz = entry(5);
    scale = load(g.weight + first) * root(inverse[0] * inverse[1] * inverse[2] * inverse_two_pi_cubed);
  }

  Vectors operator*(const Vectors& v) const noexcept {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
};

/// A point as Gaussians see it. It is found out in steps, each for several points: the chain of operations of one is long,
/// and the next one's runs beside it.
struct Seen {
  Vectors x, drag;            // the point, and −R ÿ for q̈ = 0 and ẍ = 0
  Vectors t;                  // P e
  Lanes exponent, scale;      // of the density
  Lanes slope, bend;          // eᵀ P ẏ and ẏᵀ P ẏ

  void place(const Links& link, const Vectors& mean, const GaussianBlock& gaussians, int first, const DensityPoints& points,
             int n) noexcept {
    // The point seen from the link: y and ẏ there.
    x = all(points.positions + 3 * n);
    const Vectors motion = link.linear + cross(link.angular, x);
    Vectors slip = Vectors{} - motion, twice_own_less_motion = slip;
    if (points.velocities != nullptr) {
      const Vectors own = all(points.velocities + 3 * n);
      slip = slip + own;
      twice_own_less_motion = slip + own;
    }
    const Vectors e = link.from_world(x - link.position) - mean, y_dot = link.from_world(slip);
    drag = link.bias_linear + cross(link.bias_angular, x) + cross(link.angular, twice_own_less_motion);
    const Peak peak(gaussians, first, points.radii[n]);
    t = peak * e;
    exponent = -0.5 * e.dot(t);
    scale = points.weight * peak.scale;
    slope = t.dot(y_dot);
    bend = y_dot.dot(peak * y_dot);
  }

  Lanes density() const noexcept {
    const auto counts = exponent > least_exponent;
    return counts ? scale * exponential(counts ? exponent : Lanes{}) : Lanes{};
  }
};

constexpr int together = 4;  // points

void add_density(const GaussianBlock& gaussians, const double* const* numbers, const DensityPoints& points,
                 DensitySums& sums) noexcept {
  for (int first = 0; first < gaussians.num; first += width) {
    const Links link(numbers + first);
    const Vectors mean = load(gaussians.mean, first);
    Lanes value = load(sums.value + first), curvature = load(sums.curvature + first);
    Vectors force = {}, moment = {};
    for (int start = 0; start < points.num; start += together) {
      const int number = points.num - start < together ? points.num - start : together;
      Seen seen[together];
      Lanes densities[together];
      for (int i = 0; i < number; ++i) {
        seen[i].place(link, mean, gaussians, first, points, start + i);
      }
      for (int i = 0; i < number; ++i) {
        densities[i] = seen[i].density();
      }
      for (int i = 0; i < number; ++i) {
        const Seen& at = seen[i];
        const Lanes density = densities[i];
        // δψ = f · (δv + δω × x − δx): the wrench (x × f, f) about the world origin.
        const Vectors f = link.to_world({density * at.t.x, density * at.t.y, density * at.t.z});
        value += density;
        curvature += density * (at.slope * at.slope - at.bend) + f.dot(at.drag);
        force = force + f;
        moment = moment + cross(at.x, f);
      }
    }
    store(sums.value + first, value);
    store(sums.curvature + first, curvature);
    store(sums.force, first, force);
    store(sums.moment, first, moment);
  }
}

}  // namespace
}  // namespace sidestep::kernels
