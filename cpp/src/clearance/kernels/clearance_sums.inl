// Included by clearance_kernel.inl: points in double precision, summed.

// Offset that stands for the centre of an ellipsoid, where the clearance has no gradient [m]; far below any size that matters.
constexpr double centre_offset = 1e-9;

// Errors of S, which is 1 at the foot of the perpendicular. From within the first, a step that leaves the third power ends
// within the second for nearly round ellipsoids; from there on the square is below rounding.
constexpr double cubic_within = 5e-3, polished_within = 1e-7;
constexpr int most_iterations = 16;  // Most Newton iterations.
constexpr int together = 4;          // Registers handled together.

/// As many of the lanes as there are, as bits.
inline unsigned first_lanes(int count) noexcept { return count < singles ? (1u << count) - 1u : (2u << (singles - 1)) - 1u; }

void rotate(const double* rows, const double* x, double* result) noexcept {
  for (int i = 0; i < 3; ++i) {
    result[i] = rows[3 * i] * x[0] + rows[3 * i + 1] * x[1] + rows[3 * i + 2] * x[2];
  }
}

/// Moves the spatial vector (angular, linear) at the world origin to `centre` and into principal axes.
void express(const Query& query, const double* centre, const double* angular, const double* linear, double* angular_E,
             double* linear_E) noexcept {
  const double at_centre[3] = {linear[0] + angular[1] * centre[2] - angular[2] * centre[1],
                               linear[1] + angular[2] * centre[0] - angular[0] * centre[2],
                               linear[2] + angular[0] * centre[1] - angular[1] * centre[0]};
  rotate(query.axes, angular, angular_E);
  rotate(query.axes, at_centre, linear_E);
}

/// What the sums need.
void begin_sums(QueryGroup& group, int k) noexcept {
  Query& query = group.queries[k];
  const double* axes_T = group.axes_T[k];
  const LinkMotion& link = *group.link;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {  // axes_T R_WLᵀ
      query.axes[3 * i + j] =
          axes_T[i] * link.rotation[j] + axes_T[3 + i] * link.rotation[3 + j] + axes_T[6 + i] * link.rotation[6 + j];
    }
    query.squared_axes[i] = group.semi_axes[k][i] * group.semi_axes[k][i];
    query.precision[i] = 1.0 / query.squared_axes[i];
  }
  const double* A = query.squared_axes;
  query.shortest = A[0] <= A[1] && A[0] <= A[2] ? 0 : A[1] <= A[2] ? 1 : 2;
  const double centre[3] = {group.centre[0][k], group.centre[1][k], group.centre[2][k]};
  express(query, centre, link.angular, link.linear, query.angular, query.linear);
  express(query, centre, link.bias_angular, link.bias_linear, query.bias_angular, query.bias_linear);
  for (auto& lanes : query.lane_sums) {
    for (double& sum : lanes) {
      sum = 0.0;
    }
  }
  query.begun = true;
}

/// Old weights are smaller by the exponential of this.
Lanes decay(double shift, double inverse_T) noexcept {
  return exponential(all(shift * inverse_T < 690.0 ? -shift * inverse_T : -690.0));
}

/// Where points outside an ellipsoid with squared semi-axes A are seen from it: w = e / (A + t) with t > 0 where
/// S = Σ A w² = 1.
struct Foot {
  Lanes t, inverses[3], w[3];  // 1 / (A + t)
  Lanes inverse_flatness;      // 1 / Σ A w² / (A + t), nearly

  /// n'·v, of points that move by v. With D = (A + t)⁻¹ it is (v·w' − (n·v)(n·w'))/|w| for w' = D (v − w t') and
  /// t' = (w·v − t w·Dv) / (|w|² − t w·Dw), as A D is 1 − t D; along is w·v. The divisor is the flatness, polished.
  Lanes bend(const Lanes* v, Lanes along, Lanes squared_norm, Lanes inverse_norm) const noexcept {
    Lanes v_v = {}, w_v = {}, w_w = {};
    for (int i = 0; i < 3; ++i) {
      const Lanes scaled = inverses[i] * v[i];
      v_v += scaled * v[i];
      w_v += scaled * w[i];
      w_w += inverses[i] * w[i] * w[i];
    }
    const Lanes t_dot = (along - t * w_v) * nearer_inverse(squared_norm - t * w_w, inverse_flatness);
    const Lanes share = along * inverse_norm * inverse_norm;
    return (v_v - t_dot * w_v - share * (w_v - t_dot * w_w)) * inverse_norm;
  }
};

/// The same on the way there.
struct Outside {
  Lanes t, inverses[3], w[3];    // 1 / (A + t)
  Lanes S, shares[3], flatness;  // A w² / (A + t) and their sum

  /// `last`: to rounding; else within 1e-8, which is enough for a step.
  template <bool last>
  void place(const double* A, const Lanes* e, Lanes at) noexcept {
    t = at;
    const Lanes sums[3] = {A[0] + t, A[1] + t, A[2] + t}, product = sums[0] * sums[1], of_sums = product * sums[2];
    const Lanes of_all = last ? inverse(of_sums) : quick_inverse(of_sums), of_two = of_all * sums[2];
    inverses[0] = of_two * sums[1];
    inverses[1] = of_two * sums[0];
    inverses[2] = of_all * product;
    S = flatness = Lanes{};
    for (int i = 0; i < 3; ++i) {
      w[i] = e[i] * inverses[i];
      const Lanes of_S = A[i] * w[i] * w[i];
      S += of_S;
      shares[i] = of_S * inverses[i];
      flatness += shares[i];
    }
  }

  /// Newton's step on 1/√S − 1, which is concave in t: it ends below the root, wherever it begins.
  Lanes step() const noexcept { return S * (root(S) - 1.0) * quick_inverse(flatness); }

  /// Chebyshev's step on S − 1: of an error that is small its third power is left.
  Lanes cubic_step() const noexcept {
    const Lanes per_flatness = quick_inverse(flatness);
    const Lanes newton = 0.5 * (S - 1.0) * per_flatness;
    Lanes second = {};  // Σ A w² / (A + t)²
    for (int i = 0; i < 3; ++i) {
      second += shares[i] * inverses[i];
    }
    return newton * (1.0 + 1.5 * newton * second * per_flatness);
  }

  /// Newton's step where S is so close to 1 that all changes in proportion to it.
  Foot foot() const noexcept {
    Foot at;
    at.inverse_flatness = quick_inverse(flatness);
    const Lanes step = 0.5 * (S - 1.0) * at.inverse_flatness;
    at.t = t + step;
    for (int i = 0; i < 3; ++i) {
      const Lanes change = 1.0 - step * inverses[i];
      at.w[i] = w[i] * change;
      at.inverses[i] = inverses[i] * change;
    }
    return at;
  }
};

/// Points inside: u = e / A, m = e·u < 1, h = (m − √m) / |u|.
struct Inside {
  Lanes u[3], root_m, inverse_norm, value, gradient[3];

  Inside(const double* A, const Lanes* e) noexcept {
    for (int i = 0; i < 3; ++i) {
      u[i] = e[i] / A[i];
    }
    root_m = root(e[0] * u[0] + e[1] * u[1] + e[2] * u[2]);
    inverse_norm = 1.0 / root(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    value = root_m * (root_m - 1.0) * inverse_norm;
    for (int i = 0; i < 3; ++i) {
      gradient[i] = ((2.0 - 1.0 / root_m) - value * inverse_norm / A[i]) * u[i] * inverse_norm;
    }
  }

  /// As e is A u, and the gradient along i is u_i times what all axes have in common less h / (|u|² A_i).
  Lanes twist(const double* A, int i) const noexcept {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    const Lanes common = (2.0 - 1.0 / root_m) * inverse_norm, own = value * inverse_norm * inverse_norm;
    return u[j] * u[l] * (common - own * (1.0 / A[j] + 1.0 / A[l]));
  }

  /// vᵀ ∂²h v: h |u| = m − √m, differentiated twice.
  Lanes bend(const double* A, const Lanes* v, Lanes rate) const noexcept {
    Lanes m_dot = {}, m_ddot = {}, norm_dot = {}, squared = {};
    for (int i = 0; i < 3; ++i) {
      const Lanes u_dot = v[i] / A[i];
      m_dot += 2.0 * u[i] * v[i];
      m_ddot += 2.0 * u_dot * v[i];
      norm_dot += u[i] * u_dot * inverse_norm;
      squared += u_dot * u_dot;
    }
    const Lanes root_dot = 0.5 * m_dot / root_m;
    const Lanes root_ddot = (0.5 * m_ddot - root_dot * root_dot) / root_m;
    const Lanes norm_ddot = (squared - norm_dot * norm_dot) * inverse_norm;
    return (m_ddot - root_ddot - 2.0 * rate * norm_dot - value * norm_ddot) * inverse_norm;
  }
};

/// Points that are summed in double precision, and where their iteration begins, with room for whole registers.
struct Chosen {
  int size;
  bool are_outside;  // all of them
  int point[most_candidates + singles];
  float t[most_candidates + singles];

  /// Those of the candidates of which either bound is below its limit. The errors of the bounds are larger than those
  /// of rounding the limits.
  Chosen(const Candidates& candidates, float limit, float limit_ahead) noexcept : size(0) {
    const Singles limits = all(limit), limits_ahead = all(limit_ahead);
    unsigned maybe_inside = 0;
    for (int i = 0; i < candidates.size; i += singles) {
      const unsigned far = below(limits, load(candidates.least[0] + i)) & below(limits_ahead, load(candidates.least[1] + i));
      const unsigned near = ~far & first_lanes(candidates.size - i);
      compress(t + size, load(candidates.t + i), near);
      compress(point + size, candidates.point + i, near);
      size += __builtin_popcount(near);
      maybe_inside |= ~below(Singles{}, load(candidates.least[0] + i)) & near;
    }
    are_outside = maybe_inside == 0;
    for (int i = size; i % width != 0; ++i) {
      t[i] = t[0];
      point[i] = point[0];
    }
  }
};

/// Points in double precision, side by side; infinitely far where no more are chosen.
struct Samples {
  Lanes h, after, rate, g[3];  // h + τ h', h', and ∂h in principal axes
  // its moment about the centre, (A_j − A_l) times which it is along axis i, in cyclic order
  Lanes twist[3];
  Lanes curvature;  // h'' without what the bias of the link makes, which is linear in ∂h and its moment
};

/// How samples are found: in steps, each for several registers. The chain of operations of one is long, and the next
/// one's runs beside it. `moves`: whether points move; `outside`: whether all are.
template <bool moves, bool outside>
class Approach {
 public:
  /// Where a register from `first` on lies, and Newton's iteration up to where it nearly ends.
  void begin(const QueryGroup& group, int k, const Points& points, const Chosen& chosen, int first) noexcept {
    const Query& query = group.queries[k];
    const double *R = query.axes, *A = query.squared_axes, *W = query.angular;
    const int* point = chosen.point + first;
    t_ = widen(chosen.t + first);
    radius_ = points.common_radius >= 0.0 ? all(points.common_radius) : gather(points.radius, point);
    Lanes x[3];
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] = gather(points.position[axis], point) - group.centre[axis][k];
    }
    for (int i = 0; i < 3; ++i) {
      e_[i] = R[3 * i] * x[0] + R[3 * i + 1] * x[1] + R[3 * i + 2] * x[2];
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      v_[i] = -query.linear[i] - (W[j] * e_[l] - W[l] * e_[j]);
    }
    if constexpr (moves) {
      for (int axis = 0; axis < 3; ++axis) {
        x[axis] = gather(points.velocity[axis], point);
      }
      for (int i = 0; i < 3; ++i) {
        own_[i] = R[3 * i] * x[0] + R[3 * i + 1] * x[1] + R[3 * i + 2] * x[2];
        v_[i] += own_[i];
      }
    }
    if constexpr (!outside) {
      Lanes m = {};
      for (int i = 0; i < 3; ++i) {
        m += e_[i] * e_[i] * query.precision[i];
      }
      inside_ = m < 1.0;
      are_inside_ = below(m, all(1.0));
      t_ = inside_ ? Lanes{} : t_;
    }
    Outside out;
    out.place<false>(A, e_, t_);
    Lanes step = out.cubic_step();
    if (__builtin_expect(are_far(out.S, cubic_within), 0)) {
      step = magnitude(out.S - 1.0) > cubic_within ? out.step() : step;
    }
    move(step);
  }

  /// To where it ends.
  void settle(const QueryGroup& group, int k) noexcept {
    const double* A = group.queries[k].squared_axes;
    Outside out;
    out.place<true>(A, e_, t_);
    for (int i = 0; i < most_iterations && __builtin_expect(are_far(out.S, polished_within), 0); ++i) {
      move(out.step());
      out.place<true>(A, e_, t_);
    }
    foot_ = out.foot();
  }

  /// What is summed of it; `count`: of points from this register on.
  void finish(const QueryGroup& group, int k, int count, Samples& result) noexcept {
    const Query& query = group.queries[k];
    const double *A = query.squared_axes, *W = query.angular;
    const Lanes* w = foot_.w;
    const Lanes squared_norm = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    const Lanes inverse_norm = inverse_root(squared_norm);
    Lanes h = foot_.t * squared_norm * inverse_norm, *g = result.g;
    for (int i = 0; i < 3; ++i) {
      g[i] = w[i] * inverse_norm;
    }
    for (int i = 0; i < 3; ++i) {
      result.twist[i] = w[(i + 1) % 3] * g[(i + 2) % 3];  // as e is (A + t) w
    }
    const Lanes along = w[0] * v_[0] + w[1] * v_[1] + w[2] * v_[2];
    Lanes curvature = foot_.bend(v_, along, squared_norm, inverse_norm);
    result.rate = along * inverse_norm;
    if (!outside && are_inside_ != 0) {
      const Lanes squared = e_[0] * e_[0] + e_[1] * e_[1] + e_[2] * e_[2];
      e_[query.shortest] = squared < 1e-300 ? all(centre_offset) : e_[query.shortest];
      const Inside in(A, e_);
      h = inside_ ? in.value : h;
      for (int i = 0; i < 3; ++i) {
        g[i] = inside_ ? in.gradient[i] : g[i];
        result.twist[i] = inside_ ? in.twist(A, i) : result.twist[i];
      }
      result.rate = g[0] * v_[0] + g[1] * v_[1] + g[2] * v_[2];
      curvature = inside_ ? in.bend(A, v_, result.rate) : curvature;
    }
    result.h = h - radius_;
    result.after = result.h + group.horizon * result.rate;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      curvature -= g[i] * (W[j] * (moves ? v_[l] + own_[l] : v_[l]) - W[l] * (moves ? v_[j] + own_[j] : v_[j]));
    }
    result.curvature = curvature;
    if (count < width) {
      const auto is_chosen = lane_numbers() < count;
      result.h = is_chosen ? result.h : all(__builtin_inf());
      result.after = is_chosen ? result.after : all(__builtin_inf());
    }
  }

 private:
  bool are_far(Lanes S, double within) const noexcept { return (below(all(within), magnitude(S - 1.0)) & ~are_inside_) != 0; }
  void move(Lanes step) noexcept {
    t_ = larger(t_ + step, Lanes{});
    if constexpr (!outside) {
      t_ = inside_ ? Lanes{} : t_;
    }
  }

  Lanes e_[3], v_[3], own_[3];  // the offset in principal axes, velocities in moving ones, and those of the points
  Lanes radius_, t_;
  Foot foot_;
  Bits inside_;
  unsigned are_inside_ = 0;
};

/// Finds all that are chosen.
template <bool moves, bool outside>
void approach_all(const QueryGroup& group, int k, const Points& points, const Chosen& chosen, Samples* samples) noexcept {
  const int number = (chosen.size + width - 1) / width;
  for (int first = 0; first < number; first += together) {
    Approach<moves, outside> approaches[together];
    const int end = number < first + together ? number : first + together;
    for (int i = first; i < end; ++i) {
      approaches[i - first].begin(group, k, points, chosen, i * width);
    }
    for (int i = first; i < end; ++i) {
      approaches[i - first].settle(group, k);
    }
    for (int i = first; i < end; ++i) {
      approaches[i - first].finish(group, k, chosen.size - i * width, samples[i]);
    }
  }
}

/// The smallest of values in whole registers, and which.
struct Smallest {
  double value = __builtin_inf();
  int at = -1;

  void find(const Lanes* values, int number) noexcept {
    Lanes least = all(__builtin_inf());
    for (int i = 0; i < number; ++i) {
      least = values[i] < least ? values[i] : least;
    }
    double lanes[width];
    store(lanes, least);
    for (const double lane : lanes) {
      value = lane < value ? lane : value;
    }
    for (int i = 0; i < number && value < __builtin_inf(); ++i) {
      if (const unsigned equal = ~below(all(value), values[i]) & ((1u << width) - 1u); equal != 0) {
        at = i * width + __builtin_ctz(equal);
        return;
      }
    }
  }
};

/// Weights of old sums become smaller where what they are relative to does.
void rescale(Query& query, int first, int last, double before, double now, double inverse_T) noexcept {
  if (now < before && before < __builtin_inf()) {
    const Lanes factor = decay(before - now, inverse_T);
    for (int i = first; i < last; ++i) {
      store(query.lane_sums[i], factor * load(query.lane_sums[i]));
    }
  }
}

/// And what lies above it lies higher above: sums of w (h − reference).
void refer(Query& query, double before, double now) noexcept {
  if (now < before && before < __builtin_inf()) {
    const auto raise = [&](int sum, int by) {
      store(query.lane_sums[sum], load(query.lane_sums[sum]) + (before - now) * load(query.lane_sums[by]));
    };
    for (int i = 0; i < 4; ++i) {
      raise(4 + i, i);
    }
    for (int i = 0; i < 6; ++i) {
      raise(14 + i, 8 + i);
    }
  }
}

/// Sums of lanes that are kept in registers while samples are gone through.
template <int first, int last>
class LaneSums {
 public:
  explicit LaneSums(Query& query) noexcept : query_(query) {
    for (int i = first; i < last; ++i) {
      sums_[i - first] = load(query.lane_sums[i]);
    }
  }
  void add(int sum, Lanes term) noexcept { sums_[sum - first] += term; }
  void write() const noexcept {
    for (int i = first; i < last; ++i) {
      store(query_.lane_sums[i], sums_[i - first]);
    }
  }

 private:
  Query& query_;
  Lanes sums_[last - first];
};

/// Sums for the mean of what is within reach.
void add_nearest(const QueryGroup& group, Query& query, const Samples* samples, int number) noexcept {
  const double inverse_T = group.inverse_T;
  LaneSums<0, approach> sums(query);
  for (int n = 0; n < number; ++n) {
    const Samples& at = samples[n];
    const Lanes above = at.h - query.reference;
    if (below(above, all(group.window)) == 0) {
      continue;
    }
    const auto weighs = above < group.window;
    const Lanes over = weighs ? above : Lanes{}, rate = at.rate;
    const Lanes weight = weighs ? exponential(-inverse_T * over) : Lanes{};
    const Lanes weight_rate = weight * rate, weight_over = weight * over, over_rate = weight_over * rate;
    sums.add(0, weight);
    sums.add(1, weight_rate);
    sums.add(2, weight * at.curvature);
    sums.add(3, weight_rate * rate);
    sums.add(4, weight_over);
    sums.add(5, over_rate);
    sums.add(6, weight_over * at.curvature);
    sums.add(7, over_rate * rate);
    for (int i = 0; i < 3; ++i) {
      sums.add(8 + i, weight * at.g[i]);
      sums.add(11 + i, weight * at.twist[i]);
      sums.add(14 + i, weight_over * at.g[i]);
      sums.add(17 + i, weight_over * at.twist[i]);
    }
  }
  sums.write();
}

/// Sums for the mean of what approaches; where nothing comes within reach, of what is nearest.
void add_approach(const QueryGroup& group, Query& query, const Samples* samples, int number) noexcept {
  LaneSums<approach, kernels::sums> sums(query);
  const bool comes = query.ahead < group.reach_ahead;
  for (int n = 0; n < number; ++n) {
    const Samples& at = samples[n];
    const Lanes beyond = at.after - query.ahead;
    const Lanes after = comes ? beyond : at.h < query.reference + group.window ? beyond : all(__builtin_inf());
    if (below(after, all(group.window_ahead)) == 0) {
      continue;
    }
    const auto weighs = after < group.window_ahead;
    const Lanes weight = weighs ? exponential(weighs ? -group.inverse_T * after : Lanes{}) : Lanes{};
    sums.add(approach, weight);
    sums.add(approach + 1, weight * (weighs ? at.h : Lanes{}));
    sums.add(approach + 2, weight * at.rate);
    sums.add(approach + 3, weight * at.curvature);
    for (int i = 0; i < 3; ++i) {
      sums.add(approach + 4 + i, weight * at.g[i]);
      sums.add(approach + 7 + i, weight * at.twist[i]);
    }
  }
  sums.write();
}

void sum_candidates(QueryGroup& group, int k, const Points& points) noexcept {
  Query& query = group.queries[k];
  Candidates& candidates = query.candidates;
  const bool had_sums = query.begun;
  if (!had_sums) {
    begin_sums(group, k);
  }
  // The limits are those of the smallest clearances and a window, as far as bounds say. Before any is known within
  // reach, what is left out is noted.
  const float nothing = -__builtin_inff();
  const auto note = [&candidates](int which, float& missed) {
    for (int i = 0; i < candidates.size; ++i) {
      missed = candidates.least[which][i] < missed ? candidates.least[which][i] : missed;
    }
  };
  if (!query.near) {
    note(0, group.missed[k]);
  }
  if (!query.approached) {
    note(1, group.missed_ahead[k]);
  }
  const Chosen chosen(candidates, query.near ? group.near[k] : nothing, query.approached ? group.ahead[k] : nothing);
  candidates.size = 0;
  Samples samples[most_candidates / width];
  const int number = (chosen.size + width - 1) / width;
  const bool moves = points.velocity[0] != nullptr;
  const auto find = moves ? (chosen.are_outside ? approach_all<true, true> : approach_all<true, false>)
                          : (chosen.are_outside ? approach_all<false, true> : approach_all<false, false>);
  find(group, k, points, chosen, samples);
  const double reference = query.reference, ahead = query.ahead;
  Lanes values[most_candidates / width];
  for (int i = 0; i < number; ++i) {
    values[i] = samples[i].h;
  }
  Smallest nearest, minded;
  nearest.find(values, number);
  if (nearest.value < group.reach && nearest.value < reference) {
    query.reference = nearest.value;
    query.nearest = chosen.point[nearest.at];
  }
  rescale(query, 0, approach, reference, query.reference, group.inverse_T);
  refer(query, reference, query.reference);
  for (int i = 0; i < number; ++i) {
    const auto counts = (samples[i].h < query.reference + group.window) | (samples[i].after < group.reach_ahead);
    values[i] = counts ? samples[i].after : all(__builtin_inf());
  }
  minded.find(values, number);
  if (minded.value < ahead) {
    query.ahead = minded.value;
    query.minded = chosen.point[minded.at];
  }
  rescale(query, approach, sums, ahead, query.ahead, group.inverse_T);
  query.stale |= had_sums && (query.reference < reference || query.ahead < ahead);
  if (query.reference < __builtin_inf()) {
    add_nearest(group, query, samples, number);
  }
  if (query.ahead < __builtin_inf()) {
    add_approach(group, query, samples, number);
  }
}
