// A vector of three in each lane, and what is done with it. To be included after simd.inl, inside an anonymous
// namespace.

struct Vectors {
  Lanes x, y, z;

  Vectors operator+(const Vectors& o) const noexcept { return {x + o.x, y + o.y, z + o.z}; }
  Vectors operator-(const Vectors& o) const noexcept { return {x - o.x, y - o.y, z - o.z}; }
  /// By a number, or one of each lane.
  template <class Number>
  Vectors operator*(Number s) const noexcept {
    return {x * s, y * s, z * s};
  }
  Vectors& operator+=(const Vectors& o) noexcept { return *this = *this + o; }
  Lanes dot(const Vectors& o) const noexcept { return x * o.x + y * o.y + z * o.z; }
};

inline Vectors cross(const Vectors& a, const Vectors& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Vectors all(const double* v) noexcept { return {all(v[0]), all(v[1]), all(v[2])}; }

/// A row of `most_lanes` numbers for each of the three.
inline void store_rows(double* rows, const Vectors& v) noexcept {
  store(rows, v.x);
  store(rows + most_lanes, v.y);
  store(rows + 2 * most_lanes, v.z);
}
