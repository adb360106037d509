// Doubles side by side in one register of the instruction set that the including file is compiled for. To be included
// inside an anonymous namespace, after <immintrin.h> where there is one.

#if defined(__AVX512F__)
inline constexpr int width = 8;
#elif defined(__AVX2__)
inline constexpr int width = 4;
#else
inline constexpr int width = 2;
#endif

typedef double Lanes __attribute__((vector_size(8 * width)));
typedef long long Bits __attribute__((vector_size(8 * width)));

inline Lanes all(double x) noexcept { return x - Lanes{}; }

inline Lanes load(const double* p) noexcept {
  Lanes x;
  __builtin_memcpy(&x, p, sizeof x);
  return x;
}

inline void store(double* p, Lanes x) noexcept { __builtin_memcpy(p, &x, sizeof x); }

inline Lanes root(Lanes x) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_sqrt_pd(0xff, x);  // the plain form trips a warning of GCC 12
#elif defined(__AVX2__)
  return _mm256_sqrt_pd(x);
#elif defined(__SSE2__)
  return _mm_sqrt_pd(x);
#else
  for (int i = 0; i < width; ++i) {
    x[i] = __builtin_sqrt(x[i]);
  }
  return x;
#endif
}

inline Lanes magnitude(Lanes x) noexcept { return x < 0.0 ? -x : x; }

/// Lane i is bit i.
inline unsigned below(Lanes x, Lanes limit) noexcept {
#if defined(__AVX512F__)
  return _mm512_cmp_pd_mask(x, limit, _CMP_LT_OQ);
#elif defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(x, limit, _CMP_LT_OQ)));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmplt_pd(x, limit)));
#else
  unsigned bits = 0;
  for (int i = 0; i < width; ++i) {
    bits |= (x[i] < limit[i] ? 1u : 0u) << i;
  }
  return bits;
#endif
}

/// eˣ for −700 < x < 700, within 2 units in the last place: x = n ln 2 + r, |r| ≤ ln 2 / 2, and Taylor in r.
inline Lanes exponential(Lanes x) noexcept {
  const Lanes magic = all(0x1.8p52);  // adding it leaves the nearest integer in the low bits
  const Lanes shifted = x * 0x1.71547652b82fep+0 + magic;
  const Lanes n = shifted - magic;
  const Lanes r = (x - n * 0x1.62e42fefap-1) - n * 0x1.cf79abc9e3b39p-40;  // ln 2 in two parts: the first product is exact
  Lanes p = all(1.0 / 6227020800.0);
  p = p * r + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800.0;
  p = p * r + 1.0 / 3628800.0;
  p = p * r + 1.0 / 362880.0;
  p = p * r + 1.0 / 40320.0;
  p = p * r + 1.0 / 5040.0;
  p = p * r + 1.0 / 720.0;
  p = p * r + 1.0 / 120.0;
  p = p * r + 1.0 / 24.0;
  p = p * r + 1.0 / 6.0;
  p = p * r + 0.5;
  p = p * r + 1.0;
  p = p * r + 1.0;
  Bits bits;
  __builtin_memcpy(&bits, &shifted, sizeof bits);
  bits = (bits << 52) + (1023LL << 52);
  Lanes scale;
  __builtin_memcpy(&scale, &bits, sizeof scale);
  return p * scale;
}
