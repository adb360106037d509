// Included by clearance_kernel.inl: leaves and their points in single precision, to leave out what does not matter.

// Errors of single precision and of rough reciprocals: of clearances relative to distances, and of directions.
constexpr float distance_error = 3.0f * rough_error, direction_error = 6.0f * rough_error;
// Turn of the direction up to which t is near its value at the centre of a leaf, and its change there.
constexpr float most_turn = 0.6f;
constexpr int loose_steps = 2;                        // Newton steps without a starting value.
constexpr float least_height = 1e-9f, tiny = 1e-30f;  // Divisors that stand for zero.

/// What does not depend on leaves, for all ellipsoids: their principal axes in the world, and how they move.
void begin(QueryGroup& group) noexcept {
  const LinkMotion& link = *group.link;
  const double *W = link.angular, *o = group.origin;
  const float w[3] = {static_cast<float>(W[0]), static_cast<float>(W[1]), static_cast<float>(W[2])};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    group.velocity[i] = static_cast<float>(link.linear[i] + W[j] * o[l] - W[l] * o[j]);
  }
  for (int first = 0; first < group.size; first += singles) {
    Singles offset[3], v[3];
    for (int i = 0; i < 3; ++i) {
      offset[i] = load(group.offset[i] + first);
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      v[i] = group.velocity[i] + w[j] * offset[l] - w[l] * offset[j];
    }
    for (int i = 0; i < 3; ++i) {
      const auto in_link = [&](int j) { return load(group.principal + (3 * i + j) * most_queries + first); };
      Singles row[3];
      for (int j = 0; j < 3; ++j) {
        row[j] = in_link(0) * link.to_link[j] + in_link(1) * link.to_link[3 + j] + in_link(2) * link.to_link[6 + j];
        store(group.axes[3 * i + j] + first, row[j]);
      }
      store(group.own_offset[i] + first, row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2]);
      store(group.own_linear[i] + first, row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
      store(group.own_angular[i] + first, row[0] * w[0] + row[1] * w[1] + row[2] * w[2]);
    }
  }
}

/// The numbers of one ellipsoid, in its principal axes; `axes` turn the world into them, by rows.
struct Ellipsoid {
  Singles axes[9], offset[3], linear[3], angular[3], squared[3], semi[3], extent, roundness;
  Singles swirl[3];  // angular × A w, of which this is what products of w have: so w·v needs no e
  float error;

  Ellipsoid(const QueryGroup& group, int k) noexcept
      : extent(all(group.extent[k])), roundness(all(group.principal[roundness_at * most_queries + k])) {
    for (int i = 0; i < 9; ++i) {
      axes[i] = all(group.axes[i][k]);
    }
    float squared_offset = 0.0f;
    for (int i = 0; i < 3; ++i) {
      offset[i] = all(group.own_offset[i][k]);
      linear[i] = all(group.own_linear[i][k]);
      angular[i] = all(group.own_angular[i][k]);
      squared[i] = all(group.principal[(squared_at + i) * most_queries + k]);
      semi[i] = all(group.principal[(semi_at + i) * most_queries + k]);
      squared_offset += group.own_offset[i][k] * group.own_offset[i][k];
    }
    for (int i = 0; i < 3; ++i) {
      swirl[i] = angular[i] * (squared[(i + 1) % 3] - squared[(i + 2) % 3]);
    }
    error = distance_error * (group.extent[k] + __builtin_sqrtf(squared_offset));
  }

  /// Places seen from the group's origin, in principal axes.
  void place(Singles x, Singles y, Singles z, Singles* e) const noexcept {
    for (int i = 0; i < 3; ++i) {
      e[i] = axes[3 * i] * x + axes[3 * i + 1] * y + axes[3 * i + 2] * z - offset[i];
    }
  }

  /// Vectors of the world in principal axes.
  void turn(const float* x, const float* y, const float* z, Singles* result) const noexcept {
    for (int i = 0; i < 3; ++i) {
      result[i] = axes[3 * i] * load(x) + axes[3 * i + 1] * load(y) + axes[3 * i + 2] * load(z);
    }
  }
};

/// t of places at e from below, nearly: the best of where Newton's iteration comes to from infinity and, along every
/// axis, of that axis alone. `second` is Σ A e².
inline Singles first_t(const Ellipsoid& of, const Singles* e, Singles second) noexcept {
  Singles fourth = {};  // Σ A² e²
  for (int i = 0; i < 3; ++i) {
    const Singles share = of.squared[i] * e[i];
    fourth += share * share;
  }
  second = larger(second, all(tiny));
  const Singles inverse_second = rough_inverse_root(second);
  Singles t = larger((second - fourth * inverse_second) * inverse_second - 1e-12f, Singles{});  // 0 at the centre
  for (int i = 0; i < 3; ++i) {
    t = larger(of.semi[i] * magnitude(e[i]) - of.squared[i], t);
  }
  return t;
}

/// Places as an ellipsoid with squared semi-axes A sees them, side by side: at e in its principal axes, with w = e / (A
/// + t). Outside t > 0 is where S = Σ A w² is 1, which Newton's iteration finds.
struct Sight {
  Singles t, w[3], squared_norm, S, flatness;  // |w|², Σ A w² / (A + t)

  Sight() = default;
  /// Also writes 1 / (A + t).
  Sight(const Ellipsoid& of, const Singles* e, Singles at, Singles* inverses) noexcept
      : t(at), squared_norm{}, S{}, flatness{} {
    for (int i = 0; i < 3; ++i) {
      inverses[i] = rough_inverse(of.squared[i] + t);
      w[i] = e[i] * inverses[i];
      const Singles squared = w[i] * w[i], share = of.squared[i] * squared;
      squared_norm += squared;
      S += share;
      flatness += share * inverses[i];
    }
  }

  /// Where Newton's step on 1/√S − 1 ends, which is concave in t: below the root, wherever it begins; inside at 0.
  Singles next() const noexcept {
    return larger(t + S * (rough_root(S) - 1.0f) * rough_inverse(larger(flatness, all(tiny))), Singles{});
  }
};

/// What is true of places whatever t is: the plane that touches the ellipsoid where its normal is w, at p = A w/√S,
/// bounds h from below; and as e − p is t w and √S − 1 of p, the direction to the foot differs from w by |√S − 1| |p| /
/// h at most.
struct TangentPlane {
  Singles inverse_norm, height;  // 1 / |w|; h from below, nearly, as √S is less than (1 + S) / 2
  Singles above;                 // h − height, at most
  Singles tilt;                  // |n − w/|w||, at most

  TangentPlane(const Ellipsoid& of, const Sight& at) noexcept {
    const Singles over = at.S - 1.0f;
    inverse_norm = rough_inverse_root(larger(at.squared_norm, all(tiny)));
    height = (at.t * at.squared_norm + 0.5f * over) * inverse_norm;
    // |√S − 1|, at most, which is |S − 1| / (1 + √S). So much of p lies aside of the normal; and as much, squared, is
    // what √S is less than (1 + S) / 2 by.
    const Singles share = magnitude(over) * (over > -0.2f ? all(0.53f) : all(1.0f)) + 2.0f * rough_error;
    tilt = smaller(of.extent * share * rough_inverse(larger(height, all(least_height))), all(2.0f)) + direction_error;
    above = 0.5f * share * (of.extent * tilt + share * inverse_norm);
  }

  /// w·v/|w| of what is at rest in the world: v is −(linear + angular × e), and angular × t w is nothing to w.
  Singles rate(const Ellipsoid& of, const Singles* w) const noexcept {
    return -(w[0] * (of.linear[0] + of.swirl[2] * w[1]) + w[1] * (of.linear[1] + of.swirl[0] * w[2]) +
             w[2] * (of.linear[2] + of.swirl[1] * w[0])) *
           inverse_norm;
  }
};

using LeafBits = unsigned long long;

/// Where the leaves of the group are.
void place(QueryGroup& group, const Points& points) noexcept {
  Leaves& leaves = group.leaves;
  const Boxes& boxes = points.leaf_boxes;
  for (int i = 0; i < leaves.num; ++i) {
    const int leaf = leaves.leaf[i];
    leaves.centre[0][i] = static_cast<float>(boxes.x[leaf] - group.origin[0]);
    leaves.centre[1][i] = static_cast<float>(boxes.y[leaf] - group.origin[1]);
    leaves.centre[2][i] = static_cast<float>(boxes.z[leaf] - group.origin[2]);
    leaves.half[0][i] = static_cast<float>(boxes.half_x[leaf]);
    leaves.half[1][i] = static_cast<float>(boxes.half_y[leaf]);
    leaves.half[2][i] = static_cast<float>(boxes.half_z[leaf]);
    leaves.largest[i] = static_cast<float>(boxes.radius[leaf]);
  }
  // Registers are filled up: what was there may be denormal, of which an operation costs a hundred others.
  for (int i = leaves.num; i % singles != 0; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      leaves.centre[axis][i] = leaves.half[axis][i] = 0.0f;
    }
    leaves.largest[i] = 0.0f;
  }
  LoosePoints& loose = group.loose;
  for (int n = loose.num; n % singles != 0; ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      loose.position[axis][n] = loose.own[axis][n] = 0.0f;
    }
    loose.radius[n] = 0.0f;
  }
  const double* W = group.link->angular;
  const float w[3] = {static_cast<float>(W[0]), static_cast<float>(W[1]), static_cast<float>(W[2])};
  const float turning = static_cast<float>(group.link->turning), fastest = static_cast<float>(group.fastest);
  for (int i = 0; i < leaves.num; i += singles) {
    Singles c[3], v[3], squared = {};
    for (int axis = 0; axis < 3; ++axis) {
      c[axis] = load(leaves.centre[axis] + i);
      const Singles half = load(leaves.half[axis] + i);
      squared += half * half;
    }
    for (int axis = 0; axis < 3; ++axis) {
      const int j = (axis + 1) % 3, l = (axis + 2) % 3;
      v[axis] = group.velocity[axis] + w[j] * c[l] - w[l] * c[j];
    }
    for (int axis = 0; axis < 3; ++axis) {
      store(leaves.velocity[axis] + i, v[axis]);
    }
    const Singles distance = root(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    const Singles diagonal = root(squared), speed = root(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    store(leaves.diagonal + i, diagonal);
    store(leaves.speed + i, speed);
    store(leaves.more + i, turning * diagonal + fastest + direction_error * speed);
    store(leaves.error + i, distance_error * (distance + diagonal));
  }
  leaves.loaded = 0;
}

/// The points of leaf i of the group.
void load_points(QueryGroup& group, const Points& points, int i) noexcept {
  Leaves& leaves = group.leaves;
  const int from = leaves.leaf[i] * most_points, to = i * most_points;
  for (int n = 0; n < most_points; n += singles) {
    for (int axis = 0; axis < 3; ++axis) {
      store(leaves.position[axis] + to + n, narrow(points.position[axis] + from + n, group.origin[axis]));
      if (points.velocity[0] != nullptr) {
        store(leaves.own[axis] + to + n, narrow(points.velocity[axis] + from + n));
      }
    }
    store(leaves.radius + to + n, narrow(points.radius + from + n));
  }
  leaves.loaded |= 1ull << i;
}

/// The lanes that are bits; others are infinite.
inline Singles chosen(Singles x, unsigned lanes) noexcept {
#if defined(__AVX512F__)
  return _mm512_mask_blend_ps(static_cast<__mmask16>(lanes), all(__builtin_inff()), x);
#else
  for (int i = 0; i < singles; ++i) {
    x[i] = (lanes >> i & 1) != 0 ? x[i] : __builtin_inff();
  }
  return x;
#endif
}

/// What an ellipsoid sees of leaves: bounds from below of h of all their points, and of h + τ h'; and t near them, as
/// t0 + gradient · e. In steps, each for several registers: the chain of operations of one is long, and the next one's
/// runs beside it.
struct LeafBounds {
  alignas(64) float least[most_leaves], after[most_leaves], t0[most_leaves], gradient[3][most_leaves];
  float turn[most_leaves];  // of directions within the leaf

  LeafBounds(const QueryGroup& group, const Ellipsoid& of, int k) noexcept {
    const int num = group.leaves.num;
    const auto may_matter = [&](int first) {
      return below(group.near[k], group.ahead[k], first, num < first + singles ? num : first + singles) != 0;
    };
    Centres centres[most_leaves / singles];
    int size = 0;
    for (int first = 0; first < num; first += singles) {
      Centres& at = centres[size];
      separate(group, of, first, at);
      if (may_matter(first)) {
        at.sight = Sight(of, at.e, first_t(of, at.e, at.second), at.inverses);
        ++size;
      }
    }
    for (int n = 0; n < size; ++n) {
      bound(group, of, centres[n]);
      if (may_matter(centres[n].first)) {
        extrapolate(of, centres[n]);
      }
    }
  }

  /// Those of the leaves [first, last) that may matter.
  LeafBits below(float near, float ahead, int first, int last) const noexcept {
    LeafBits bits = 0;
    for (int i = first; i < last; i += singles) {
      const unsigned lanes = kernels::below(load(least + i), all(near)) | kernels::below(load(after + i), all(ahead));
      bits |= static_cast<LeafBits>(lanes & first_lanes(last - i)) << i;
    }
    return bits;
  }

  void note_missed(QueryGroup& group, int k, LeafBits seen) const noexcept {
    const int num = group.leaves.num;
    Singles missed = all(__builtin_inff()), missed_ahead = missed;
    for (int i = 0; i < num; i += singles) {
      const unsigned lanes = static_cast<unsigned>(~seen >> i) & first_lanes(num - i);
      missed = smaller(missed, chosen(load(least + i), lanes));
      missed_ahead = smaller(missed_ahead, chosen(load(after + i), lanes));
    }
    const float least_missed = smallest(missed), least_missed_ahead = smallest(missed_ahead);
    group.missed[k] = least_missed < group.missed[k] ? least_missed : group.missed[k];
    group.missed_ahead[k] = least_missed_ahead < group.missed_ahead[k] ? least_missed_ahead : group.missed_ahead[k];
  }

 private:
  /// Of a register of leaves.
  struct Centres {
    int first;
    Singles e[3], second, inverses[3];  // Σ A e², 1 / (A + t)
    Singles apart, margin, stopped;     // h from below, error and largest radius, and how far points come nearer
    Sight sight;
  };

  /// The plane across the way from centre to centre says enough of many: towards it an ellipsoid reaches √(Σ A e²)/|e|.
  /// Of points that may be inside it says nothing.
  void separate(const QueryGroup& group, const Ellipsoid& of, int i, Centres& at) noexcept {
    const Leaves& leaves = group.leaves;
    at.first = i;
    of.place(load(leaves.centre[0] + i), load(leaves.centre[1] + i), load(leaves.centre[2] + i), at.e);
    Singles squared = {};
    at.second = Singles{};
    for (int j = 0; j < 3; ++j) {
      const Singles square = at.e[j] * at.e[j];
      squared += square;
      at.second += of.squared[j] * square;
    }
    at.margin = load(leaves.largest + i) + (load(leaves.error + i) + of.error);
    at.stopped = static_cast<float>(group.horizon) * (load(leaves.speed + i) + load(leaves.more + i));
    const Singles apart = (squared - rough_root(at.second)) * rough_inverse_root(larger(squared, all(tiny))) -
                          (load(leaves.diagonal + i) + at.margin);
    at.apart = apart > 0.0f ? apart : all(-__builtin_inff());
    store(least + i, at.apart);
    store(after + i, at.apart - at.stopped);
  }

  void bound(const QueryGroup& group, const Ellipsoid& of, const Centres& at) noexcept {
    const Leaves& leaves = group.leaves;
    const int i = at.first;
    const float horizon = static_cast<float>(group.horizon);
    const Singles speed = load(leaves.speed + i), more = load(leaves.more + i), diagonal = load(leaves.diagonal + i);
    const TangentPlane plane(of, at.sight);
    const Singles* w = at.sight.w;
    Singles n[3], v[3], half[3], along = {}, box = {};
    for (int j = 0; j < 3; ++j) {
      n[j] = (of.axes[j] * w[0] + of.axes[3 + j] * w[1] + of.axes[6 + j] * w[2]) * plane.inverse_norm;
      v[j] = load(leaves.velocity[j] + i);
      half[j] = load(leaves.half[j] + i);
      along += n[j] * v[j];
      box += half[j] * magnitude(n[j]);
    }
    // h is convex: at d from the centre it is more by n·d at least. n changes by H d for a matrix H between 0 and that
    // of a sphere as round as the ellipsoid is anywhere, κ; then −dᵀ H v is −κ (|d| |v| + d·v) / 2 at least.
    const Singles lowest = plane.height - box;
    const Singles bend = rough_inverse(of.roundness + larger(lowest, Singles{}));
    const Singles share = (0.5f * horizon) * bend;
    const Singles across = rough_root((1.0f + 2.0f * direction_error) * speed * speed - along * along);
    Singles turning_box = {};
    for (int j = 0; j < 3; ++j) {
      const int l = (j + 1) % 3, m = (j + 2) % 3;
      const Singles swept =
          n[l] * static_cast<float>(group.link->angular[m]) - n[m] * static_cast<float>(group.link->angular[l]);
      turning_box += half[j] * magnitude(n[j] - share * (v[j] - along * n[j]) - horizon * swept);
    }
    // What points beside the centre have of the link's turn is in `turning_box` as n has it at the centre.
    const Singles swirl = static_cast<float>(group.link->turning) * diagonal;
    const Singles rest = more - swirl + swirl * smaller(bend * diagonal + plane.tilt, all(2.0f));
    const Singles turned = share * diagonal * (across + bend * diagonal * larger(-along, Singles{}));
    const Singles in_motion =
        plane.height - turning_box - turned - horizon * (along + (plane.tilt + plane.tilt) * speed + rest);
    const auto outside = lowest > at.margin;
    store(least + i, outside ? lowest - at.margin : at.apart);
    store(after + i, outside ? larger(in_motion, lowest - at.stopped) - at.margin : all(-__builtin_inff()));
    store(turn + i, bend * diagonal);
  }

  /// t of points.
  void extrapolate(const Ellipsoid& of, const Centres& at) noexcept {
    const Sight& sight = at.sight;
    const Singles inverse_flatness = rough_inverse(larger(sight.flatness, all(tiny)));
    Singles start = sight.next();
    for (int j = 0; j < 3; ++j) {
      const Singles slope = of.squared[j] * sight.w[j] * at.inverses[j] * inverse_flatness;
      start -= slope * at.e[j];
      store(gradient[j] + at.first, slope);
    }
    store(t0 + at.first, start);
  }
};

/// Of points within reach the smallest is known to be at most that of these, and a limit at most a window beyond.
inline void lower(bool& found, float& limit, float& limit_of_leaves, Singles least, Singles most, unsigned lanes, double reach,
                  double window) noexcept {
  if (!found) {
    if ((lanes & below(least, all(static_cast<float>(reach)))) == 0) {
      return;
    }
    found = true;
    limit_of_leaves = limit;
  }
  const float beyond = static_cast<float>(window);
  if (lanes &= below(most, all(limit - beyond)); lanes != 0) {
    limit_of_leaves = limit = smallest(chosen(most, lanes)) + beyond;
  }
}

/// Places by balls around ellipsoid and centre, with what moves by `own` in principal axes.
struct FarSight {
  Singles apart, closing, speed, error;  // distance, less the ball; how fast it closes in and moves, at most

  FarSight(const Ellipsoid& of, const Singles* e, const Singles* own) noexcept {
    Singles squared = {}, squared_speed = {}, along = {};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const Singles v = own[i] - of.linear[i] - (of.angular[j] * e[l] - of.angular[l] * e[j]);
      squared += e[i] * e[i];
      squared_speed += v * v;
      along -= e[i] * v;
    }
    const Singles inverse_distance = rough_inverse_root(larger(squared, all(tiny))), distance = squared * inverse_distance;
    speed = (1.0f + rough_error) * rough_root(squared_speed);
    error = distance_error * (distance + of.extent);
    apart = distance - of.extent;
    // As Horizon::closing_speed, with an angle that is rather too large.
    const Singles sine = (1.0f + distance_error) * of.extent * inverse_distance, cosine = rough_root(1.0f - sine * sine);
    const Singles across = rough_root((1.0f + 1e-6f) * squared * squared_speed - along * along);
    const Singles turned = (along * cosine + across * sine) * inverse_distance + 2.0f * direction_error * speed;
    closing = ((sine < 1.0f) & (along * inverse_distance < speed * cosine)) ? smaller(turned, speed) : speed;
  }
};

/// What an ellipsoid sees of a register of points: bounds of h and h + τ h'. Found in steps, each for several
/// registers, as those of leaves are.
struct Look {
  unsigned asked;  // lanes
  int first;       // point; negative: of loose ones, from −1 − first on
  Sight sight;
  Singles least[2], most[2];

  /// Of points of leaf i of the group, from n on.
  void begin(const Leaves& leaves, const Ellipsoid& of, const LeafBounds& bounds, int i, int n) noexcept {
    leaf_ = i;
    at_ = i * most_points + n;
    first = leaves.leaf[i] * most_points + n;
    asked = first_lanes(leaves.count[i] - n);
    Singles e[3], inverses[3], t = all(bounds.t0[i]);
    of.place(load(leaves.position[0] + at_), load(leaves.position[1] + at_), load(leaves.position[2] + at_), e);
    for (int j = 0; j < 3; ++j) {
      t += bounds.gradient[j][i] * e[j];
    }
    t = larger(t, Singles{});
    if (bounds.turn[i] > most_turn) {
      t = Sight(of, e, t, inverses).next();
    }
    sight = Sight(of, e, t, inverses);
  }

  /// `moves`: whether points do.
  template <bool moves>
  void finish(const QueryGroup& group, const Ellipsoid& of) noexcept {
    const Leaves& leaves = group.leaves;
    Singles own[3] = {};
    if constexpr (moves) {
      of.turn(leaves.own[0] + at_, leaves.own[1] + at_, leaves.own[2] + at_, own);
    }
    bound<moves>(group, of, load(leaves.radius + at_), own, all(leaves.speed[leaf_] + leaves.more[leaf_]),
                 all(leaves.error[leaf_] + of.error));
  }

  /// Of loose points, from n on. Returns whether any may matter.
  template <bool moves>
  bool find_loose(const QueryGroup& group, const Ellipsoid& of, int k, int n) noexcept {
    const LoosePoints& loose = group.loose;
    first = -1 - n;
    Singles e[3], inverses[3];
    of.place(load(loose.position[0] + n), load(loose.position[1] + n), load(loose.position[2] + n), e);
    const Singles radius = load(loose.radius + n);
    Singles own[3] = {};
    if constexpr (moves) {
      of.turn(loose.own[0] + n, loose.own[1] + n, loose.own[2] + n, own);
    }
    const FarSight far(of, e, own);
    const Singles apart = far.apart - radius - far.error;
    const Singles after = apart > 0.0f ? apart - static_cast<float>(group.horizon) * far.closing : all(-__builtin_inff());
    asked = (below(apart, all(group.near[k])) | below(after, all(group.ahead[k]))) & first_lanes(loose.num - n);
    if (asked == 0) {
      return false;
    }
    Singles second = {};
    for (int j = 0; j < 3; ++j) {
      second += of.squared[j] * (e[j] * e[j]);
    }
    sight = Sight(of, e, first_t(of, e, second), inverses);
    for (int step = 0; step < loose_steps; ++step) {
      sight = Sight(of, e, sight.next(), inverses);
    }
    bound<moves>(group, of, radius, own, far.speed, far.error);
    return true;
  }

  /// Adds the points that matter to the candidates.
  void keep(QueryGroup& group, int k, const Points& points) const noexcept {
    const unsigned kept = (below(least[0], all(group.near[k])) | below(least[1], all(group.ahead[k]))) & asked;
    if (kept == 0) {
      return;
    }
    Query& query = group.queries[k];
    lower(query.near, group.near[k], group.near_leaf[k], least[0], most[0], kept, group.reach, group.window);
    lower(query.approached, group.ahead[k], group.ahead_leaf[k], least[1], most[1], kept, group.reach_ahead,
          group.window_ahead);
    Candidates& candidates = query.candidates;
    if (candidates.size + singles > most_candidates) {
      sum_candidates(group, k, points);
    }
    const int to = candidates.size;
    compress(candidates.t + to, sight.next(), kept);
    compress(candidates.least[0] + to, least[0], kept);
    compress(candidates.least[1] + to, least[1], kept);
    if (first >= 0) {
      compress(candidates.point + to, first, kept);
    } else {
      compress(candidates.point + to, group.loose.point - 1 - first, kept);
    }
    candidates.size += __builtin_popcount(kept);
  }

 private:
  template <bool moves>
  void bound(const QueryGroup& group, const Ellipsoid& of, Singles radius, const Singles* own, Singles speed,
             Singles error) noexcept {
    const TangentPlane plane(of, sight);
    const Singles* w = sight.w;
    const float horizon = static_cast<float>(group.horizon);
    Singles rate = plane.rate(of, w);
    if constexpr (moves) {
      rate += (own[0] * w[0] + own[1] * w[1] + own[2] * w[2]) * plane.inverse_norm;
    }
    const Singles slack = horizon * (plane.tilt * speed + static_cast<float>(group.link->turning) * error);
    const auto maybe_inside = plane.height <= error;  // where no plane separates, clearances are lower than that
    least[0] = maybe_inside ? all(-__builtin_inff()) : plane.height - radius - error;
    least[1] = least[0] + horizon * rate - slack;
    most[0] = larger(plane.height + plane.above, Singles{}) + error - radius;
    most[1] = maybe_inside ? all(__builtin_inff()) : most[0] + horizon * rate + slack;
  }

  int leaf_, at_;  // of the group
};

/// Looks at the points of some leaves, and returns at which: at others no more.
template <bool moves>
LeafBits look_at(QueryGroup& group, int k, const Ellipsoid& of, const LeafBounds& bounds, LeafBits chosen,
                 const Points& points) noexcept {
  Leaves& leaves = group.leaves;
  constexpr int registers = most_points / singles, side_by_side = 6;
  Look looks[side_by_side];
  LeafBits seen = 0;
  while (chosen != 0) {
    int size = 0;
    for (; chosen != 0 && size + registers <= side_by_side; chosen &= chosen - 1) {
      const int i = __builtin_ctzll(chosen);
      if (!(bounds.least[i] < group.near_leaf[k] || bounds.after[i] < group.ahead_leaf[k])) {  // no more
        continue;
      }
      seen |= 1ull << i;
      if ((leaves.loaded >> i & 1) == 0) {
        load_points(group, points, i);
      }
      for (int n = 0; n < leaves.count[i]; n += singles) {
        looks[size++].begin(leaves, of, bounds, i, n);
      }
    }
    for (int i = 0; i < size; ++i) {
      looks[i].finish<moves>(group, of);
    }
    for (int i = 0; i < size; ++i) {
      looks[i].keep(group, k, points);
    }
  }
  return seen;
}

/// Looks at the loose points.
template <bool moves>
void look_at_loose(QueryGroup& group, int k, const Ellipsoid& of, const Points& points) noexcept {
  for (int n = 0; n < group.loose.num; n += singles) {
    Look look;
    if (look.find_loose<moves>(group, of, k, n)) {
      look.keep(group, k, points);
    }
  }
}

template <bool moves>
void collect_all(QueryGroup& group, const Points& points) noexcept {
  const int num = group.leaves.num;
  for (int k = 0; k < group.size; ++k) {
    if (group.near_leaf[k] == -__builtin_inff() && group.ahead_leaf[k] == -__builtin_inff()) {
      continue;
    }
    const Ellipsoid of(group, k);
    look_at_loose<moves>(group, k, of, points);
    if (num == 0) {
      continue;
    }
    const LeafBounds bounds(group, of, k);
    LeafBits seen = 0;
    while (const LeafBits left = bounds.below(group.near_leaf[k], group.ahead_leaf[k], 0, num) & ~seen) {
      seen |= look_at<moves>(group, k, of, bounds, left, points);
    }
    bounds.note_missed(group, k, seen);
  }
}

void collect(QueryGroup& group, const Points& points) noexcept {
  place(group, points);
  points.velocity[0] != nullptr ? collect_all<true>(group, points) : collect_all<false>(group, points);
}
