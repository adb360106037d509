// Included by one file per instruction set, after gap_kernel.hpp and intrinsics.hpp. Defines
// find_gaps and bound_gaps in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "../../math/kernels/simd.inl"

constexpr int most_steps = 16;    // Most Newton steps.
constexpr int most_halvings = 8;  // Most halvings of a step.
// Slope of φ across n at which the search ends, relative to the lengths in it: n is as accurate, and h to the square of that.
constexpr double accuracy = 1e-12;
constexpr double rounding = 1e-15;  // Rounding of φ, relative to the lengths in it.
// Distance of centres below which they have no direction [m]; such ellipsoids overlap deeply anyway.
constexpr double closest_centres = 1e-6;

inline Lanes dot(const Lanes* a, const Lanes* b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline void cross(const double* a, const Lanes* b, Lanes* result) noexcept {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    result[i] = a[j] * b[k] - a[k] * b[j];
  }
}
/// S x, of a symmetric matrix.
inline void multiply(const Lanes* S, const Lanes* x, Lanes* result) noexcept {
  result[0] = S[0] * x[0] + S[1] * x[1] + S[2] * x[2];
  result[1] = S[1] * x[0] + S[3] * x[1] + S[4] * x[2];
  result[2] = S[2] * x[0] + S[4] * x[1] + S[5] * x[2];
}
inline void normalise(Lanes* x) noexcept {
  const Lanes inverse = inverse_root(dot(x, x));
  for (int i = 0; i < 3; ++i) {
    x[i] *= inverse;
  }
}

/// An ellipsoid with its half-width s along n, and its boundary's farthest point along n, k = S n / s.
struct HalfWidth {
  Lanes S[6], k[3], s, inverse_s;

  void update(const Lanes* n) noexcept {
    multiply(S, n, k);
    const Lanes squared = dot(n, k);
    inverse_s = inverse_root(squared);
    s = squared * inverse_s;
    for (int i = 0; i < 3; ++i) {
      k[i] *= inverse_s;
    }
  }

  /// Adds ∂²s = (S − k kᵀ) / s, which maps n to zero.
  void add_curvature(Lanes* H) const noexcept {
    int entry = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j, ++entry) {
        H[entry] += (S[entry] - k[i] * k[j]) * inverse_s;
      }
    }
  }
};

/// R x + p and R S Rᵀ: what is given in b, in a.
void place(const RelativeMotion& motion, Lanes* x, Lanes* S) noexcept {
  const double* R = motion.rotation;
  Lanes y[3], M[9];
  for (int i = 0; i < 3; ++i) {
    y[i] = motion.position[i] + (R[i] * x[0] + R[3 + i] * x[1] + R[6 + i] * x[2]);
    M[3 * i] = R[i] * S[0] + R[3 + i] * S[1] + R[6 + i] * S[2];
    M[3 * i + 1] = R[i] * S[1] + R[3 + i] * S[3] + R[6 + i] * S[4];
    M[3 * i + 2] = R[i] * S[2] + R[3 + i] * S[4] + R[6 + i] * S[5];
  }
  for (int i = 0, entry = 0; i < 3; ++i) {
    x[i] = y[i];
    for (int j = i; j < 3; ++j, ++entry) {
      S[entry] = M[3 * i] * R[j] + M[3 * i + 1] * R[3 + j] + M[3 * i + 2] * R[6 + j];
    }
  }
}

/// Of the pairs [first, first + width).
void find(EllipsoidPairs& pairs, int first) noexcept {
  HalfWidth a, b;
  Lanes centre[3], d[3], n[3];
  for (int i = 0; i < 6; ++i) {
    a.S[i] = load(pairs.shape_a[i] + first);
    b.S[i] = load(pairs.shape_b[i] + first);
  }
  for (int i = 0; i < 3; ++i) {
    centre[i] = load(pairs.centre_b[i] + first);
  }
  place(pairs.motion, centre, b.S);
  for (int i = 0; i < 3; ++i) {
    d[i] = centre[i] - load(pairs.centre_a[i] + first);
  }
  const Lanes length = root(dot(d, d));
  for (int i = 0; i < 3; ++i) {
    n[i] = length > closest_centres ? d[i] : all(i == 0 ? 1.0 : 0.0);
  }
  normalise(n);
  const auto phi = [&](const Lanes* at) noexcept {
    a.update(at);
    b.update(at);
    return dot(at, d) - a.s - b.s;
  };

  Lanes value = phi(n), across, inverse, H[6];
  for (int step = 0;; ++step) {
    // Across n: the slope of φ, and the second derivative −H − φ of unit vectors, where H has two eigenvalues.
    Lanes slope[3];
    for (int i = 0; i < 3; ++i) {
      slope[i] = d[i] - a.k[i] - b.k[i] - value * n[i];
    }
    for (Lanes& entry : H) {
      entry = Lanes{};
    }
    a.add_curvature(H);
    b.add_curvature(H);
    const Lanes trace = H[0] + H[3] + H[5];
    const Lanes det = (H[0] * H[3] - H[1] * H[1]) + (H[0] * H[5] - H[2] * H[2]) + (H[3] * H[5] - H[4] * H[4]);
    // Ellipsoids that overlap more deeply than they are curved have no maximum here: a definite matrix leads upwards.
    Lanes shift = value;
    if (below(value, Lanes{}) != 0) {
      const Lanes least = 0.5 * trace - root(larger(0.25 * trace * trace - det, Lanes{}));
      shift = value < 0.0 ? larger(value, -0.5 * least) : value;
    }
    // The inverse of H + shift across n is ((trace + shift) (1 − n nᵀ) − H) / (det + shift trace + shift²).
    across = trace + shift;
    inverse = 1.0 / (det + shift * across);  // which may be zero
    const Lanes small = accuracy * (length + a.s + b.s);
    const Lanes squared = dot(slope, slope);
    if (step == most_steps || below(small * small, squared) == 0) {
      break;
    }
    const auto open = squared > small * small;
    Lanes along[3];
    multiply(H, slope, along);
    for (int i = 0; i < 3; ++i) {
      along[i] = inverse * (across * slope[i] - along[i]);
    }
    const Lanes enough = value - rounding * (length + a.s + b.s);  // near the maximum the slope says more than φ
    Lanes share = all(1.0), next[3];
    for (int halving = 0; halving < most_halvings; ++halving) {
      for (int i = 0; i < 3; ++i) {
        next[i] = n[i] + share * along[i];
      }
      normalise(next);
      for (int i = 0; i < 3; ++i) {
        next[i] = open ? next[i] : n[i];
      }
      value = phi(next);
      if (below(value, enough) == 0) {
        break;
      }
      share = value < enough ? 0.5 * share : share;
    }
    for (int i = 0; i < 3; ++i) {
      n[i] = next[i];
    }
  }

  // Of b, seen from a: how its centre and S n / s move, with n held. ṁ = n × ω, and m̈, is n seen from b.
  const RelativeMotion& motion = pairs.motion;
  const double *omega = motion.angular, *alpha = motion.bias_angular;
  Lanes d_dot[3], d_ddot[3], turned[3], m_dot[3], S_m_dot[3], m_ddot[3], bent[3], k_turned[3];
  const Lanes* k = b.k;
  cross(omega, centre, turned);
  for (int i = 0; i < 3; ++i) {
    d_dot[i] = motion.linear[i] + turned[i];
  }
  cross(omega, d_dot, bent);
  cross(alpha, centre, turned);
  for (int i = 0; i < 3; ++i) {
    d_ddot[i] = motion.bias_linear[i] + turned[i] + bent[i];
  }
  cross(omega, n, turned);
  for (int i = 0; i < 3; ++i) {
    m_dot[i] = -turned[i];
  }
  multiply(b.S, m_dot, S_m_dot);
  cross(omega, turned, bent);
  cross(alpha, n, turned);
  for (int i = 0; i < 3; ++i) {
    m_ddot[i] = bent[i] - turned[i];
  }
  const Lanes s_dot = dot(k, m_dot);
  const Lanes s_ddot = dot(k, m_ddot) + (dot(m_dot, S_m_dot) - s_dot * s_dot) * b.inverse_s;
  cross(omega, k, k_turned);
  Lanes g[3], W_g[3];
  for (int i = 0; i < 3; ++i) {
    g[i] = d_dot[i] - k_turned[i] - (S_m_dot[i] - k[i] * s_dot) * b.inverse_s;
  }
  const Lanes along = dot(g, n);
  for (int i = 0; i < 3; ++i) {
    g[i] -= along * n[i];
  }
  multiply(H, g, W_g);
  for (int i = 0; i < 3; ++i) {
    W_g[i] = inverse * (across * g[i] - W_g[i]);
  }
  store(pairs.value + first, value);
  store(pairs.rate + first, dot(n, d_dot) - s_dot);
  store(pairs.curvature + first, dot(n, d_ddot) - s_ddot + dot(g, W_g));
  for (int i = 0; i < 3; ++i) {
    store(pairs.normal[i] + first, n[i]);
    store(pairs.contact[i] + first, centre[i] - k[i]);
  }
}

void find_gaps(EllipsoidPairs& pairs) noexcept {
  if (pairs.size == 0) {
    return;
  }
  const auto repeat_last = [&pairs](auto& columns) noexcept {
    for (auto& column : columns) {
      for (int k = pairs.size; k % width != 0; ++k) {
        column[k] = column[pairs.size - 1];
      }
    }
  };
  repeat_last(pairs.centre_a);
  repeat_last(pairs.centre_b);
  repeat_last(pairs.shape_a);
  repeat_last(pairs.shape_b);
  for (int first = 0; first < pairs.size; first += width) {
    find(pairs, first);
  }
}

/// φ of the unit vector along the line of centres.
void bound_gaps(const EllipsoidColumns& a, const double* rotation, const double* centre, const double* shape,
                double* bounds) noexcept {
  Lanes S_b[6];
  for (int i = 0; i < 6; ++i) {
    S_b[i] = all(shape[i]);
  }
  for (int first = 0; first < a.size; first += width) {
    Lanes S_a[6], d[3], d_b[3], S_d[3];
    for (int i = 0; i < 6; ++i) {
      S_a[i] = load(a.shape[i] + first);
    }
    for (int i = 0; i < 3; ++i) {
      d[i] = centre[i] - load(a.centre[i] + first);
    }
    for (int i = 0; i < 3; ++i) {
      d_b[i] = rotation[3 * i] * d[0] + rotation[3 * i + 1] * d[1] + rotation[3 * i + 2] * d[2];
    }
    const Lanes squared = dot(d, d), least = all(closest_centres * closest_centres);
    multiply(S_a, d, S_d);
    Lanes half_widths = quick_root(dot(d, S_d));
    multiply(S_b, d_b, S_d);
    half_widths += quick_root(dot(d_b, S_d));
    store(bounds + first, (squared - half_widths) * inverse_root(larger(squared, least)));
  }
}

}  // namespace
}  // namespace sidestep::kernels
