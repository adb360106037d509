// A vector of three in each lane, and what is done with it. To be included after lanes.inl, inside an anonymous namespace.

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

/// a × b + c × d.
inline Vectors sum_of_crosses(const Vectors& a, const Vectors& b, const Vectors& c, const Vectors& d) noexcept {
  return cross(a, b) + cross(c, d);
}

inline Vectors all(const double* v) noexcept { return {all(v[0]), all(v[1]), all(v[2])}; }

/// Three numbers of which those of each lane stand in a row of `most_lanes`.
inline Vectors load_rows(const double* rows) noexcept {
  return {load(rows), load(rows + most_lanes), load(rows + 2 * most_lanes)};
}

inline void store_rows(double* rows, const Vectors& v) noexcept {
  store(rows, v.x);
  store(rows + most_lanes, v.y);
  store(rows + 2 * most_lanes, v.z);
}
