// Included by one file per instruction set, after density_kernel.hpp and intrinsics.hpp. Defines
// add_density in an anonymous namespace.

#include "../../robot/kernels/link_numbers.hpp"

namespace sidestep::kernels {
namespace {

#include "../../math/kernels/simd.inl"
#include "../../math/kernels/vectors.inl"

constexpr double inverse_two_pi_cubed = 1.0 / 248.05021344239853;  // The number 1/(2π)³.
constexpr double least_exponent = -700.0;  // Smallest exponent: below, a density is no normal number and taken as zero.

/// Gaussians of a block side by side, from one on.
struct SideBySide {
  const GaussianBlock& gaussians;
  int first;

  Lanes operator()(const double (&row)[most_lanes]) const noexcept { return load(row + first); }
};

inline void store(double (&rows)[3][most_lanes], int first, const Vectors& v) noexcept { store_rows(rows[0] + first, v); }

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

/// The links of the lanes, from their numbers (see link_numbers.hpp), gathered once.
class GatheredLinks {
 public:
  explicit GatheredLinks(const double* const* links) noexcept
      : rotation_{gather(links, 0), gather(links, 3), gather(links, 6)},
        position_(gather(links, position_at)),
        velocity_{gather(links, velocity_at), gather(links, velocity_at + 3)},
        bias_{gather(links, bias_at), gather(links, bias_at + 3)} {}

  const Vectors& rotation(int column) const noexcept { return rotation_[column]; }
  const Vectors& position() const noexcept { return position_; }
  const Vectors& angular() const noexcept { return velocity_[0]; }
  const Vectors& linear() const noexcept { return velocity_[1]; }
  const Vectors& bias_angular() const noexcept { return bias_[0]; }
  const Vectors& bias_linear() const noexcept { return bias_[1]; }

 private:
  Vectors rotation_[3], position_, velocity_[2], bias_[2];
};

Vectors from_world(const GatheredLinks& link, const Vectors& v) noexcept {
  return {link.rotation(0).dot(v), link.rotation(1).dot(v), link.rotation(2).dot(v)};
}

Vectors to_world(const GatheredLinks& link, const Vectors& v) noexcept {
  return link.rotation(0) * v.x + link.rotation(1) * v.y + link.rotation(2) * v.z;
}

/// scale · exp(−½ eᵀ P e).
struct Peak {
  Lanes xx, yy, zz, xy, xz, yz, scale;

  Peak(const SideBySide& lanes, double radius) noexcept {
    const GaussianBlock& g = lanes.gaussians;
    if (!(radius > 0.0)) {
      const auto entry = [&](int i) noexcept { return lanes(g.precision[i]); };
      xx = entry(0), yy = entry(1), zz = entry(2), xy = entry(3), xz = entry(4), yz = entry(5);
      scale = lanes(g.scale);
      return;
    }
    Lanes inverse[3];
    for (int i = 0; i < 3; ++i) {
      inverse[i] = 1.0 / (lanes(g.variances[i]) + radius * radius);
    }
    const auto entry = [&](int i) noexcept {
      return inverse[0] * lanes(g.projections[0][i]) + inverse[1] * lanes(g.projections[1][i]) +
             inverse[2] * lanes(g.projections[2][i]);
    };
    xx = entry(0), yy = entry(1), zz = entry(2), xy = entry(3), xz = entry(4), yz = entry(5);
    scale = lanes(g.weight) * root(inverse[0] * inverse[1] * inverse[2] * inverse_two_pi_cubed);
  }

  Vectors operator*(const Vectors& v) const noexcept {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
};

/// A point as Gaussians see it. It is found out in steps, each for several points: the chain of operations of one is
/// long, and the next one's runs beside it.
struct Seen {
  Vectors x, drag;        // the point, and −R ÿ for q̈ = 0 and ẍ = 0
  Vectors t;              // P e
  Lanes exponent, scale;  // of the density
  Lanes slope, bend;      // eᵀ P ẏ and ẏᵀ P ẏ

  void place(const GatheredLinks& link, const Vectors& mean, const SideBySide& gaussians, const DensityPoints& points,
             int n) noexcept {
    // The point seen from the link: y and ẏ there.
    x = all(points.positions + 3 * n);
    const Vectors motion = link.linear() + cross(link.angular(), x);
    Vectors slip = Vectors{} - motion, twice_own_less_motion = slip;
    if (points.velocities != nullptr) {
      const Vectors own = all(points.velocities + 3 * n);
      slip = slip + own;
      twice_own_less_motion = slip + own;
    }
    const Vectors e = from_world(link, x - link.position()) - mean, y_dot = from_world(link, slip);
    drag = link.bias_linear() + cross(link.bias_angular(), x) + cross(link.angular(), twice_own_less_motion);
    const Peak peak(gaussians, points.radii[n]);
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

/// What Gaussians and points add up to, lane by lane.
struct Added {
  Lanes value = {}, curvature = {};
  Vectors force = {}, moment = {};  // the wrench about the world origin

  void add(const GatheredLinks& link, const SideBySide& gaussians, const DensityPoints& points) noexcept {
    constexpr int together = 4;  // Points handled together.
    const GaussianBlock& g = gaussians.gaussians;
    const Vectors mean{gaussians(g.mean[0]), gaussians(g.mean[1]), gaussians(g.mean[2])};
    for (int start = 0; start < points.num; start += together) {
      const int number = points.num - start < together ? points.num - start : together;
      Seen seen[together];
      Lanes densities[together];
      for (int i = 0; i < number; ++i) {
        seen[i].place(link, mean, gaussians, points, start + i);
      }
      for (int i = 0; i < number; ++i) {
        densities[i] = seen[i].density();
      }
      for (int i = 0; i < number; ++i) {
        const Seen& at = seen[i];
        const Lanes density = densities[i];
        // δψ = f · (δv + δω × x − δx): the wrench (x × f, f) about the world origin.
        const Vectors f = to_world(link, at.t * density);
        value += density;
        curvature += density * (at.slope * at.slope - at.bend) + f.dot(at.drag);
        force += f;
        moment += cross(at.x, f);
      }
    }
  }
};

void add_density(const GaussianBlock& gaussians, const double* const* numbers, const DensityPoints& points,
                 DensitySums& sums) noexcept {
  for (int first = 0; first < gaussians.num; first += width) {
    Added added{load(sums.value + first), load(sums.curvature + first)};
    added.add(GatheredLinks(numbers + first), SideBySide{gaussians, first}, points);
    store(sums.value + first, added.value);
    store(sums.curvature + first, added.curvature);
    store(sums.force, first, added.force);
    store(sums.moment, first, added.moment);
  }
}

}  // namespace
}  // namespace sidestep::kernels
