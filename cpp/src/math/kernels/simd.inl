// Doubles side by side in one register of the instruction set that the including file is compiled for. To be included
// inside an anonymous namespace, after intrinsics.hpp.

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
#elif defined(__aarch64__)
  return vsqrtq_f64(x);
#else
  for (int i = 0; i < width; ++i) {
    x[i] = __builtin_sqrt(x[i]);
  }
  return x;
#endif
}

// One instruction each, which compilers make two or three of the plain forms: y where one is not a number.
inline Lanes larger(Lanes x, Lanes y) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_max_pd(0xff, x, y);
#elif defined(__AVX2__)
  return _mm256_max_pd(x, y);
#elif defined(__SSE2__)
  return _mm_max_pd(x, y);
#else
  return x > y ? x : y;
#endif
}

inline Lanes smaller(Lanes x, Lanes y) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_min_pd(0xff, x, y);
#elif defined(__AVX2__)
  return _mm256_min_pd(x, y);
#elif defined(__SSE2__)
  return _mm_min_pd(x, y);
#else
  return x < y ? x : y;
#endif
}

inline Lanes magnitude(Lanes x) noexcept {
  Bits bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  bits &= 0x7fffffffffffffffLL;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

/// from[index[0]], from[index[1]], … one by one: the instruction that does it at once takes longer, on Zen 4.
inline Lanes gather(const double* from, const int* index) noexcept {
#if defined(__AVX512F__)
  return Lanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
               from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
#elif defined(__AVX2__)
  return Lanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]]};
#else
  return Lanes{from[index[0]], from[index[1]]};
#endif
}

/// Newton's step towards 1/x from y: squares its error.
inline Lanes nearer_inverse(Lanes x, Lanes y) noexcept { return y * (2.0 - x * y); }

/// 1/x of positive numbers within 4e-9 of it; of others not a number.
inline Lanes quick_inverse(Lanes x) noexcept {
#if defined(__AVX512F__)
  return nearer_inverse(x, _mm512_maskz_rcp14_pd(0xff, x));
#else
  return 1.0 / x;
#endif
}

/// 1/x and 1/√x of positive numbers within 2 units in the last place; of others not a number.
inline Lanes inverse(Lanes x) noexcept {
#if defined(__AVX512F__)
  const Lanes y = quick_inverse(x);
  return y + y * (1.0 - x * y);
#else
  return 1.0 / x;
#endif
}

inline Lanes inverse_root(Lanes x) noexcept {
#if defined(__AVX512F__)
  // y within 2⁻¹⁴ of it is made larger by (1 − e)^−½ for e = 1 − x y²; the next term is below rounding.
  const Lanes y = _mm512_maskz_rsqrt14_pd(0xff, x), e = 1.0 - (x * y) * y;
  return y + (y * e) * (0.5 + e * (0.375 + 0.3125 * e));
#else
  return 1.0 / root(x);
#endif
}

/// √x within 1e-15, or 1e-150; of numbers below zero as well.
inline Lanes quick_root(Lanes x) noexcept {
#if defined(__AVX512F__)
  const Lanes positive = larger(x, all(1e-300));
  return positive * inverse_root(positive);
#else
  return root(larger(x, Lanes{}));
#endif
}

/// √x and 1/√x within 2⁻¹⁴ of them, or 1e-150; the root also of numbers below zero.
inline Lanes rough_inverse_root(Lanes x) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_rsqrt14_pd(0xff, x);
#else
  return 1.0 / root(x);
#endif
}
inline Lanes rough_root(Lanes x) noexcept {
#if defined(__AVX512F__)
  const Lanes positive = larger(x, all(1e-300));
  return positive * rough_inverse_root(positive);
#else
  return root(larger(x, Lanes{}));
#endif
}

/// Lane i is bit i.
inline unsigned below(Lanes x, Lanes limit) noexcept {
#if defined(__AVX512F__)
  return _mm512_cmp_pd_mask(x, limit, _CMP_LT_OQ);
#elif defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(x, limit, _CMP_LT_OQ)));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd(_mm_cmplt_pd(x, limit)));
#elif defined(__aarch64__)
  constexpr uint64x2_t bit = {1, 2};
  return static_cast<unsigned>(vaddvq_u64(vandq_u64(vcltq_f64(x, limit), bit)));
#else
  unsigned bits = 0;
  for (int i = 0; i < width; ++i) {
    bits |= (x[i] < limit[i] ? 1u : 0u) << i;
  }
  return bits;
#endif
}

// Floats in a register.
inline constexpr int singles = 2 * width;
typedef float Singles __attribute__((vector_size(4 * singles)));

inline Singles all(float x) noexcept { return x - Singles{}; }

inline Singles load(const float* p) noexcept {
  Singles x;
  __builtin_memcpy(&x, p, sizeof x);
  return x;
}

inline void store(float* p, Singles x) noexcept { __builtin_memcpy(p, &x, sizeof x); }

inline Singles larger(Singles x, Singles y) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_max_ps(0xffff, x, y);
#elif defined(__AVX2__)
  return _mm256_max_ps(x, y);
#elif defined(__SSE2__)
  return _mm_max_ps(x, y);
#else
  return x > y ? x : y;
#endif
}

inline Singles smaller(Singles x, Singles y) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_min_ps(0xffff, x, y);
#elif defined(__AVX2__)
  return _mm256_min_ps(x, y);
#elif defined(__SSE2__)
  return _mm_min_ps(x, y);
#else
  return x < y ? x : y;
#endif
}

inline Singles magnitude(Singles x) noexcept {
  typedef int Bits __attribute__((vector_size(4 * singles)));
  Bits bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  bits &= 0x7fffffff;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

/// 1/x and 1/√x of positive numbers, within this share of them: 2⁻¹⁴ or 3 · 2⁻¹³ (NEON, after a step of Newton's: 2⁻¹⁵).
#if defined(__AVX512F__)
inline constexpr float rough_error = 6.2e-5f;  // Relative error of 1/x and 1/√x.
#else
inline constexpr float rough_error = 3.7e-4f;
#endif
inline Singles rough_inverse(Singles x) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_rcp14_ps(0xffff, x);
#elif defined(__AVX2__)
  return _mm256_rcp_ps(x);
#elif defined(__SSE2__)
  return _mm_rcp_ps(x);
#elif defined(__aarch64__)
  const Singles y = vrecpeq_f32(x), step = vrecpsq_f32(x, y);  // y within 2⁻⁸; one step of Newton's
  return y * step;
#else
  return 1.0f / x;
#endif
}

inline Singles rough_inverse_root(Singles x) noexcept {
#if defined(__AVX512F__)
  return _mm512_maskz_rsqrt14_ps(0xffff, x);
#elif defined(__AVX2__)
  return _mm256_rsqrt_ps(x);
#elif defined(__SSE2__)
  return _mm_rsqrt_ps(x);
#elif defined(__aarch64__)
  const Singles y = vrsqrteq_f32(x), step = vrsqrtsq_f32(x, y * y);
  return y * step;
#else
  Singles y;
  for (int i = 0; i < singles; ++i) {
    y[i] = 1.0f / __builtin_sqrtf(x[i]);
  }
  return y;
#endif
}

/// 1/√x within 1e-6: one step of Newton's.
inline Singles inverse_root(Singles x) noexcept {
  const Singles y = rough_inverse_root(x);
  return y * (1.5f - 0.5f * x * y * y);
}

/// √x within 1e-6, or 1e-15; of numbers below zero as well.
inline Singles root(Singles x) noexcept {
  const Singles positive = larger(x, all(1e-30f));
  return positive * inverse_root(positive);
}

/// √x within `rough_error`, or 1e-15; of numbers below zero as well.
inline Singles rough_root(Singles x) noexcept {
  const Singles positive = larger(x, all(1e-30f));
  return positive * rough_inverse_root(positive);
}

/// Writes the lanes that are bits one after another; what lies between them and a full register is overwritten.
inline void compress(float* p, Singles x, unsigned lanes) noexcept {
#if defined(__AVX512F__)
  store(p, _mm512_maskz_compress_ps(static_cast<__mmask16>(lanes), x));
#else
  for (; lanes != 0; lanes &= lanes - 1) {
    *p++ = x[__builtin_ctz(lanes)];
  }
#endif
}

/// The same of numbers, and of first + lane.
inline void compress(int* p, const int* from, unsigned lanes) noexcept {
#if defined(__AVX512F__)
  __m512i x;
  __builtin_memcpy(&x, from, sizeof x);
  x = _mm512_maskz_compress_epi32(static_cast<__mmask16>(lanes), x);
  __builtin_memcpy(p, &x, sizeof x);
#else
  for (; lanes != 0; lanes &= lanes - 1) {
    *p++ = from[__builtin_ctz(lanes)];
  }
#endif
}

inline void compress(int* p, int first, unsigned lanes) noexcept {
#if defined(__AVX512F__)
  const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i x =
      _mm512_maskz_compress_epi32(static_cast<__mmask16>(lanes), _mm512_add_epi32(lane, _mm512_set1_epi32(first)));
  __builtin_memcpy(p, &x, sizeof x);
#else
  for (; lanes != 0; lanes &= lanes - 1) {
    *p++ = first + __builtin_ctz(lanes);
  }
#endif
}

/// 0, 1, 2, …
inline Lanes lane_numbers() noexcept {
  Lanes x;
  for (int i = 0; i < width; ++i) {
    x[i] = i;
  }
  return x;
}

/// Doubles from an array, less one that is taken off before they become singles.
inline Singles narrow(const double* p, double less = 0.0) noexcept {
  const Lanes low = load(p) - less, high = load(p + width) - less;
#if defined(__AVX512F__)
  const auto single = [](Lanes x) { return _mm512_maskz_cvtpd_ps(0xff, x); };
  return _mm512_maskz_insertf32x8(0xffff, _mm512_maskz_insertf32x8(0xffff, Singles{}, single(low), 0), single(high), 1);
#elif defined(__AVX2__)
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm256_cvtpd_ps(low)), _mm256_cvtpd_ps(high), 1);
#elif defined(__SSE2__)
  return _mm_movelh_ps(_mm_cvtpd_ps(low), _mm_cvtpd_ps(high));
#elif defined(__aarch64__)
  return vcvt_high_f32_f64(vcvt_f32_f64(low), high);
#else
  Singles x;
  for (int i = 0; i < width; ++i) {
    x[i] = static_cast<float>(low[i]);
    x[width + i] = static_cast<float>(high[i]);
  }
  return x;
#endif
}

inline Lanes widen(const float* p) noexcept {
  typedef float Halves __attribute__((vector_size(4 * width)));
  Halves x;
  __builtin_memcpy(&x, p, sizeof x);
  return __builtin_convertvector(x, Lanes);
}

/// Halves against each other, down to one number.
template <int size>
inline float smallest_of(const float* values) noexcept {
  if constexpr (size == 1) {
    return values[0];
  } else {
    typedef float Half __attribute__((vector_size(2 * size)));
    Half low, high;
    __builtin_memcpy(&low, values, sizeof low);
    __builtin_memcpy(&high, values + size / 2, sizeof high);
    low = low < high ? low : high;
    float rest[size / 2];
    __builtin_memcpy(rest, &low, sizeof low);
    return smallest_of<size / 2>(rest);
  }
}

inline float smallest(Singles x) noexcept {
  float values[singles];
  store(values, x);
  return smallest_of<singles>(values);
}

inline unsigned below(Singles x, Singles limit) noexcept {
#if defined(__AVX512F__)
  return _mm512_cmp_ps_mask(x, limit, _CMP_LT_OQ);
#elif defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(x, limit, _CMP_LT_OQ)));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(x, limit)));
#elif defined(__aarch64__)
  constexpr uint32x4_t bit = {1, 2, 4, 8};
  return vaddvq_u32(vandq_u32(vcltq_f32(x, limit), bit));
#else
  unsigned bits = 0;
  for (int i = 0; i < singles; ++i) {
    bits |= (x[i] < limit[i] ? 1u : 0u) << i;
  }
  return bits;
#endif
}

/// eˣ for −700 < x < 700, within 2 units in the last place: x = n ln 2 + r, |r| ≤ ln 2 / 2, and Taylor in r. Its terms
/// are taken in pairs, and these in pairs (Estrin): one after the other they would wait for each other. Where a
/// register holds 2^0, 2^⅛, … and gives them by number, n counts eighths, and fewer terms do.
inline Lanes exponential(Lanes x) noexcept {
  const Lanes magic = all(0x1.8p52);  // adding it leaves the nearest integer in the low bits
#if defined(__AVX512F__)
  const Lanes eighths = x * 0x1.71547652b82fep+3 + magic, num_eighths = eighths - magic;
  const Lanes rest = (x - num_eighths * 0x1.62e42fefap-4) - num_eighths * 0x1.cf79abc9e3b39p-43;
  const Lanes rest2 = rest * rest;
  const Lanes q2 = rest * (1.0 / 6.0) + 0.5, q4 = rest * (1.0 / 120.0) + 1.0 / 24.0;
  const Lanes q6 = rest * (1.0 / 5040.0) + 1.0 / 720.0 + rest2 * (1.0 / 40320.0);
  const Lanes more = rest + rest2 * (q2 + rest2 * (q4 + rest2 * q6));
  const Lanes powers = {1.0,
                        0x1.172b83c7d517bp+0,
                        0x1.306fe0a31b715p+0,
                        0x1.4bfdad5362a27p+0,
                        0x1.6a09e667f3bcdp+0,
                        0x1.8ace5422aa0dbp+0,
                        0x1.ae89f995ad3adp+0,
                        0x1.d5818dcfba487p+0};
  Bits number, power_bits;
  __builtin_memcpy(&number, &eighths, sizeof number);
  const Lanes power_of_two = _mm512_maskz_permutexvar_pd(0xff, reinterpret_cast<__m512i>(number), powers);
  __builtin_memcpy(&power_bits, &power_of_two, sizeof power_bits);
  power_bits += number >> 3 << 52;
  Lanes power;
  __builtin_memcpy(&power, &power_bits, sizeof power);
  return power + power * more;
#else
  const Lanes shifted = x * 0x1.71547652b82fep+0 + magic;
  const Lanes n = shifted - magic;
  // ln 2 in two parts: the first product is exact
  const Lanes r = (x - n * 0x1.62e42fefap-1) - n * 0x1.cf79abc9e3b39p-40;
  const Lanes r2 = r * r, r4 = r2 * r2;
  const Lanes p2 = r * (1.0 / 6.0) + 0.5 + r2 * (r * (1.0 / 120.0) + 1.0 / 24.0);
  const Lanes p6 = r * (1.0 / 5040.0) + 1.0 / 720.0 + r2 * (r * (1.0 / 362880.0) + 1.0 / 40320.0);
  const Lanes p10 = r * (1.0 / 39916800.0) + 1.0 / 3628800.0 + r2 * (r * (1.0 / 6227020800.0) + 1.0 / 479001600.0);
  const Lanes p = 1.0 + (r + r2 * (p2 + r4 * (p6 + r4 * p10)));
  Bits bits;
  __builtin_memcpy(&bits, &shifted, sizeof bits);
  bits = (bits << 52) + (1023LL << 52);
  Lanes scale;
  __builtin_memcpy(&scale, &bits, sizeof scale);
  return p * scale;
#endif
}
