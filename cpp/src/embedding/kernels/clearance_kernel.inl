// Included by one file per instruction set, after clearance_kernel.hpp and <immintrin.h> where there is one. Defines
// measure, collect and sum_candidates in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"

// Stands for the centre of an ellipsoid, where the clearance has no gradient [m]; far below any size that matters.
constexpr double centre_offset = 1e-9;

// S is 1 at the foot of the perpendicular; the iteration ends above by rounding.
constexpr double converged = 1.0 + 2e-14;
constexpr float squared_converged = 1.0f + 8e-5f;
constexpr int most_iterations = 16;
constexpr double cubic_within = 1e-4;  // of S: the cube is below what counts, on whatever side of the root it is

// Errors of single precision, of clearances relative to distances, of rates relative to speeds, and of points relative to the
// size of their leaf, which is large where one of them is far away.
constexpr float distance_error = 1e-4f, rate_error = 1e-3f, place_error = 1e-6f;
constexpr float blurred = 1e-5f;  // [m] of places, from where on no direction to them counts as known

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

/// What the bounds need.
void prepare(QueryGroup& group, int k) noexcept {
  Query& query = group.queries[k];
  const double* axes_T = group.axes_T[k];
  const LinkMotion& link = *group.link;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {  // axes_T R_WLᵀ
      query.axes[3 * i + j] = axes_T[i] * link.rotation[j] + axes_T[3 + i] * link.rotation[3 + j] +
                              axes_T[6 + i] * link.rotation[6 + j];
    }
    query.squared_axes[i] = group.semi_axes[k][i] * group.semi_axes[k][i];
  }
  const double centre[3] = {group.centre[0][k], group.centre[1][k], group.centre[2][k]};
  express(query, centre, link.angular, link.linear, query.angular, query.linear);
  const double* A = query.squared_axes;
  query.shortest = A[0] <= A[1] && A[0] <= A[2] ? 0 : A[1] <= A[2] ? 1 : 2;
  auto& single = query.single;
  for (int i = 0; i < 9; ++i) {
    single.axes[i] = static_cast<float>(query.axes[i]);
  }
  for (int i = 0; i < 3; ++i) {
    single.semi_axes[i] = static_cast<float>(group.semi_axes[k][i]);
    single.squared_axes[i] = static_cast<float>(query.squared_axes[i]);
  }
  query.candidates.size = 0;
  query.ready = true;
}

/// What the sums need.
void begin_sums(QueryGroup& group, int k) noexcept {
  Query& query = group.queries[k];
  const double centre[3] = {group.centre[0][k], group.centre[1][k], group.centre[2][k]};
  express(query, centre, group.link->bias_angular, group.link->bias_linear, query.bias_angular, query.bias_linear);
  for (int i = 0; i < 3; ++i) {
    query.precision[i] = 1.0 / query.squared_axes[i];
  }
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

/// As Horizon::closing_speed: the angle of n to x is within that of the ball, asin(radius/|x|). `across` is |x × v|.
template <class Values>
Values closing_speed(Values along, Values across, Values inverse_distance, Values radius, Values speed) noexcept {
  const Values sine = radius * inverse_distance, cosine = quick_root(1 - sine * sine);
  const Values turned = (along * cosine + across * sine) * inverse_distance;
  return (sine < 1) & (along * inverse_distance < speed * cosine) ? turned : speed;
}

/// Points outside an ellipsoid with squared semi-axes A, seen from it: w = e / (A + t) with t > 0 where S = Σ A w² = 1.
template <class Values>
struct Outside {
  Values t, inverses[3], w[3], shares[3], S, flatness;  // 1 / (A + t), A w², Σ A w² / (A + t)

  template <class Number>
  void place(const Number* A, const Values* e) noexcept {
    const Values sums[3] = {A[0] + t, A[1] + t, A[2] + t}, product = sums[0] * sums[1];
    const Values of_all = inverse(product * sums[2]), of_two = of_all * sums[2];
    inverses[0] = of_two * sums[1];
    inverses[1] = of_two * sums[0];
    inverses[2] = of_all * product;
    S = flatness = Values{};
    for (int i = 0; i < 3; ++i) {
      w[i] = e[i] * inverses[i];
      shares[i] = A[i] * w[i] * w[i];
      S += shares[i];
      flatness += shares[i] * inverses[i];
    }
  }

  /// Newton's step on 1/√S − 1, which is concave in t: it ends below the root, wherever it begins.
  Values step(Values root_S) const noexcept { return S * (root_S - 1) * inverse(flatness); }

  /// Chebyshev's step on the same where S is close to 1: of an error that is small its third power is left.
  Values cubic_step() const noexcept {
    const Values over = S - 1, inverse_flatness = inverse(flatness);
    const Values newton = S * (over * (0.5 - over * (0.125 - 0.0625 * over))) * inverse_flatness;
    Values second = {};  // Σ A w² / (A + t)²
    for (int i = 0; i < 3; ++i) {
      second += shares[i] * inverses[i] * inverses[i];
    }
    const Values bend = second * inverse_flatness - flatness * (1 - over);  // 1/S is 2 − S, where S is close to 1
    return newton * (1 + 1.5 * newton * bend);
  }

  Values inverse_norm() const noexcept { return inverse_root(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]); }
  Values norm(Values inverse_norm) const noexcept { return (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) * inverse_norm; }

  /// n' · v, of points that move by v.
  Lanes bend(const double* A, const Lanes* v, Lanes inverse_norm) const noexcept {
    const Lanes t_dot =
        (A[0] * w[0] * inverses[0] * v[0] + A[1] * w[1] * inverses[1] * v[1] + A[2] * w[2] * inverses[2] * v[2]) / flatness;
    Lanes along = {}, squared = {}, across = {};
    for (int i = 0; i < 3; ++i) {
      const Lanes w_dot = (v[i] - w[i] * t_dot) * inverses[i];
      along += w[i] * w_dot;
      across += w[i] * v[i];
      squared += w_dot * v[i];
    }
    return (squared - across * along * inverse_norm * inverse_norm) * inverse_norm;
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

/// As many of the lanes as there are, as bits.
inline unsigned first_lanes(int count) noexcept { return count < singles ? (1u << count) - 1u : (2u << (singles - 1)) - 1u; }

struct Leaf {
  int first, count;
  double x, y, z, radius;

  Leaf(const Points& points, int leaf, int number) noexcept
      : first(leaf * most_points),
        count(number),
        x(points.leaf_balls.x[leaf]),
        y(points.leaf_balls.y[leaf]),
        z(points.leaf_balls.z[leaf]),
        radius(points.leaf_balls.radius[leaf]) {}
};

/// The points of a leaf in single precision, seen from its centre, and how they move as a link sees them.
struct LeafPoints {
  alignas(64) float position[3][most_points], radius[most_points], velocity[3][most_points];
  alignas(64) float closing[most_points];  // [m] within the horizon, at most
  float blur, turning_blur;                // [m] of places and [m/s] of velocities

  /// `motion` is the velocity of the link's point at the leaf's centre.
  LeafPoints(const Points& points, const Leaf& leaf, const LinkMotion& link, const float* motion, float horizon) noexcept
      : blur(place_error * static_cast<float>(leaf.radius)), turning_blur(0.0f) {
    const double centre[3] = {leaf.x, leaf.y, leaf.z};
    for (int axis = 0; axis < 3; ++axis) {
      const double* from = points.position[axis] + leaf.first;
      for (int n = 0; n < most_points; ++n) {
        position[axis][n] = static_cast<float>(from[n] - centre[axis]);
      }
    }
    for (int n = 0; n < most_points; ++n) {
      radius[n] = static_cast<float>(points.radius[leaf.first + n]);
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const float W_j = static_cast<float>(link.angular[j]), W_l = static_cast<float>(link.angular[l]);
      turning_blur += blur * __builtin_fabsf(W_j);
      for (int n = 0; n < most_points; ++n) {
        velocity[i][n] = -motion[i] - (W_j * position[l][n] - W_l * position[j][n]);
      }
      if (points.velocity[0] != nullptr) {
        const double* own = points.velocity[i] + leaf.first;
        for (int n = 0; n < most_points; ++n) {
          velocity[i][n] += static_cast<float>(own[n]);
        }
      }
    }
    for (int n = 0; n < most_points; n += singles) {
      const Singles vx = load(velocity[0] + n), vy = load(velocity[1] + n), vz = load(velocity[2] + n);
      store(closing + n, horizon * ((1.0f + rate_error) * root(vx * vx + vy * vy + vz * vz) + turning_blur));
    }
  }
};

/// Of points within reach, which are bits, the smallest is known to be at most that of these. Returns whether the limit of
/// leaves changes.
inline bool lower(bool& found, float& limit, float& limit_of_leaves, Singles most, unsigned lanes, double window) noexcept {
  found = true;
  const Singles above = most + static_cast<float>(window);
  for (lanes &= below(above, all(limit)); lanes != 0; lanes &= lanes - 1) {
    const float value = above[__builtin_ctz(lanes)];
    limit = value < limit ? value : limit;
  }
  const bool changes = limit != limit_of_leaves;
  limit_of_leaves = limit;
  return changes;
}

void sum_candidates(QueryGroup& group, int k, const Points& points) noexcept;

/// What an ellipsoid sees of a register of a leaf's points, in single precision. It is found out in steps, each for all
/// ellipsoids that look at the leaf: one's chain of operations is long, and the next one's runs beside it.
struct Look {
  int k, n;        // ellipsoid and first point
  unsigned asked;  // lanes
  Singles x[3], e[3];  // the offset in the world and in principal axes
  Singles distance, radius, error;
  Singles closing;             // within the horizon, at most
  Outside<Singles> out;
  Singles inverse_norm, least;  // h from below

  static Singles dot(const Singles* a, const Singles* b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

  /// Where nothing is known but that the clearance is negative: gradients are longer than one.
  auto is_inside() const noexcept { return (out.t <= 0.0f) & (out.S < 1.0f); }

  /// Lanes with bounds of h that matter.
  unsigned matters(const QueryGroup& group, Singles value) const noexcept {
    return (below(value, all(group.near[k])) | below(value - closing, all(group.ahead[k]))) & asked;
  }

  /// Whether any point may matter by the ball around the ellipsoid.
  bool begin(const QueryGroup& group, int ellipsoid, const Leaf& leaf, const LeafPoints& in_leaf, int first_point,
             float closing_of_leaf) noexcept {
    k = ellipsoid, n = first_point;
    const float extent = group.extent[k];
    asked = first_lanes(leaf.count - n);
    x[0] = load(in_leaf.position[0] + n) + static_cast<float>(leaf.x - group.centre[0][k]);
    x[1] = load(in_leaf.position[1] + n) + static_cast<float>(leaf.y - group.centre[1][k]);
    x[2] = load(in_leaf.position[2] + n) + static_cast<float>(leaf.z - group.centre[2][k]);
    radius = load(in_leaf.radius + n);
    const Singles squared = larger(dot(x, x), all(1e-30f));
    const Singles inverse_distance = inverse_root(squared);
    distance = squared * inverse_distance;
    error = distance_error * (distance + extent) + in_leaf.blur;
    closing = smaller(load(in_leaf.closing + n), all(closing_of_leaf));
    const Singles least_by_ball = distance - extent - radius - error;
    if (matters(group, least_by_ball) == 0) {
      return false;
    }
    if (!(leaf.radius > extent && in_leaf.blur < blurred)) {
      return true;
    }
    // A bound for all of a large leaf says little of a point.
    Singles v[3], across[3];
    for (int i = 0; i < 3; ++i) {
      v[i] = load(in_leaf.velocity[i] + n);
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      across[i] = x[j] * v[l] - x[l] * v[j];
    }
    const Singles speed = root(dot(v, v));
    const Singles of_point = closing_speed(-dot(x, v), root(dot(across, across)), inverse_distance, all(extent), speed);
    closing = smaller(static_cast<float>(group.horizon) * (of_point + rate_error * speed + in_leaf.turning_blur), closing);
    return matters(group, least_by_ball) != 0;
  }

  void place(const float* A) noexcept {
    out.place(A, e);
    inverse_norm = out.inverse_norm();
    least = is_inside() ? all(-__builtin_inff()) : out.t * out.norm(inverse_norm) - radius - error;
  }

  /// t from below, and so is t |w| below h: the best of where Newton's iteration comes to from infinity and, along every axis,
  /// of that axis alone.
  void bound(const QueryGroup& group) noexcept {
    const auto& single = group.queries[k].single;
    const float *R = single.axes, *A = single.squared_axes;
    Singles second = {}, fourth = {};  // Σ A e² and Σ A² e²
    for (int i = 0; i < 3; ++i) {
      e[i] = R[3 * i] * x[0] + R[3 * i + 1] * x[1] + R[3 * i + 2] * x[2];
      const Singles share = A[i] * e[i];
      second += share * e[i];
      fourth += share * share;
    }
    // The root of nothing is not quite nothing: at the centre t is 0.
    out.t = larger(root(second) - fourth * inverse(second > 1e-30f ? second : all(1e-30f)) - 1e-12f, Singles{});
    for (int i = 0; i < 3; ++i) {
      out.t = larger(single.semi_axes[i] * magnitude(e[i]) - A[i], out.t);
    }
    place(A);
  }

  /// Newton's iteration, as far as it matters.
  void refine(const QueryGroup& group) noexcept {
    const float* A = group.queries[k].single.squared_axes;
    for (int i = 0; i < most_iterations && (below(all(squared_converged), out.S) & matters(group, least)) != 0; ++i) {
      out.t += larger(out.step(root(out.S)), Singles{});
      place(A);
    }
  }

  /// Adds the points that matter to the candidates. Returns whether a limit of leaves changed.
  bool keep(QueryGroup& group, const Points& points, const Leaf& leaf, const LeafPoints& in_leaf) noexcept {
    Query& query = group.queries[k];
    const float* R = query.single.axes;
    const Singles from[3] = {load(in_leaf.velocity[0] + n), load(in_leaf.velocity[1] + n), load(in_leaf.velocity[2] + n)};
    Singles v[3];  // in moving axes
    for (int i = 0; i < 3; ++i) {
      v[i] = R[3 * i] * from[0] + R[3 * i + 1] * from[1] + R[3 * i + 2] * from[2];
    }
    const float horizon = static_cast<float>(group.horizon), shortest = query.single.semi_axes[query.shortest];
    const Singles speed = root(dot(v, v));
    const Singles rate = dot(out.w, v) * inverse_norm;
    const Singles after = horizon * rate, after_error = horizon * rate_error * speed;
    const auto inside = is_inside(), converged = out.S <= squared_converged;
    const auto rate_known = ~inside & converged & (all(in_leaf.blur) < blurred);
    const Singles after_least = rate_known ? least + after - after_error : least - closing;
    const unsigned is_near = below(least, all(group.near[k])) & asked;
    const unsigned kept = is_near | (below(after_least, all(group.ahead[k])) & asked);
    if (kept == 0) {
      return false;
    }
    const Singles h_most = inside ? error - radius : converged ? least + 2.0f * error : distance - shortest - radius + error;
    const Singles after_most = rate_known ? h_most + after + after_error : all(__builtin_inff());
    bool changed = false;
    const unsigned within = below(least, all(static_cast<float>(group.reach))) & kept;
    if (within != 0) {
      changed |= lower(query.near, group.near[k], group.near_leaf[k], h_most, within, group.window);
    }
    const unsigned coming = below(after_least, all(static_cast<float>(group.reach_ahead))) & kept;
    if (coming != 0) {
      changed |= lower(query.approached, group.ahead[k], group.ahead_leaf[k], after_most, coming, group.window_ahead);
    }
    Candidates& candidates = query.candidates;
    if (candidates.size + singles > most_candidates) {
      sum_candidates(group, k, points);
    }
    const int at = candidates.size;
    compress(candidates.t + at, out.t, kept);
    compress(candidates.least[0] + at, least, kept);
    compress(candidates.least[1] + at, after_least, kept);
    compress(candidates.most[0] + at, h_most, kept);
    compress(candidates.most[1] + at, after_most, kept);
    compress(candidates.point + at, leaf.first + n, kept);
    candidates.size += __builtin_popcount(kept);
    return changed;
  }
};

/// Points that are looked at in double precision, and where their iteration begins, with room for whole registers.
struct Chosen {
  int size;
  int point[most_candidates + singles];
  float t[most_candidates + singles];

  /// Those of the candidates of which either bound is below its limit. The errors of the bounds are larger than those of
  /// rounding the limits.
  Chosen(const Candidates& candidates, double limit, double limit_ahead) noexcept : size(0) {
    const Singles limits = all(static_cast<float>(limit)), limits_ahead = all(static_cast<float>(limit_ahead));
    for (int i = 0; i < candidates.size; i += singles) {
      const unsigned far = below(limits, load(candidates.least[0] + i)) & below(limits_ahead, load(candidates.least[1] + i));
      const unsigned near = ~far & first_lanes(candidates.size - i);
      compress(t + size, load(candidates.t + i), near);
      compress(point + size, candidates.point + i, near);
      size += __builtin_popcount(near);
    }
    for (int i = size; i % width != 0; ++i) {
      t[i] = t[0];
      point[i] = point[0];
    }
  }
};

constexpr int together = 4;  // registers, as the chain of operations of one is long

/// Candidates in double precision, side by side.
struct Samples {
  Lanes e[3], s[3], v[3];  // the offset in principal axes, and the velocities of the point, there and in moving axes
  Lanes radius, h, g[3], rate, after;
  Outside<Lanes> out;
  Lanes inverse_norm;
  Bits inside;
  unsigned are_inside;

  /// Where a register from `first` on lies, and Newton's iteration up to where it nearly ends.
  void begin(const QueryGroup& group, int k, const Points& points, const Chosen& chosen, int first) noexcept {
    const Query& query = group.queries[k];
    const double* R = query.axes;
    const double* A = query.squared_axes;
    const double* W = query.angular;
    const int* point = chosen.point + first;
    out.t = widen(chosen.t + first);
    radius = gather(points.radius, point);
    Lanes x[3], velocity[3] = {};
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] = gather(points.position[axis], point);
      if (points.velocity[0] != nullptr) {
        velocity[axis] = gather(points.velocity[axis], point);
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] -= group.centre[axis][k];
    }
    for (int i = 0; i < 3; ++i) {
      e[i] = R[3 * i] * x[0] + R[3 * i + 1] * x[1] + R[3 * i + 2] * x[2];
      s[i] = R[3 * i] * velocity[0] + R[3 * i + 1] * velocity[1] + R[3 * i + 2] * velocity[2];
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      v[i] = s[i] - query.linear[i] - (W[j] * e[l] - W[l] * e[j]);
    }
    Lanes m = {};
    for (int i = 0; i < 3; ++i) {
      m += e[i] * e[i] * query.precision[i];
    }
    inside = m < 1.0;
    are_inside = below(m, all(1.0));
    out.t = inside ? Lanes{} : out.t;
    out.place(A, e);
    Lanes step = out.cubic_step();
    const Lanes error = magnitude(out.S - 1.0);
    if (__builtin_expect((below(all(cubic_within), error) & ~are_inside) != 0, 0)) {
      step = error > cubic_within ? out.step(root(out.S)) : step;
    }
    out.t = inside ? Lanes{} : larger(out.t + step, Lanes{});
  }

  /// Clearances and their gradients; infinite where no more are chosen.
  void finish(const QueryGroup& group, int k, int count) noexcept {
    const Query& query = group.queries[k];
    const double* A = query.squared_axes;
    out.place(A, e);
    for (int i = 0; i < most_iterations && (below(all(converged), out.S) & ~are_inside) != 0; ++i) {
      const Lanes step = out.step(root(out.S));
      out.t += step > 0.0 ? step : Lanes{};
      out.place(A, e);
    }
    inverse_norm = out.inverse_norm();
    h = out.t * out.norm(inverse_norm) - radius;
    for (int i = 0; i < 3; ++i) {
      g[i] = out.w[i] * inverse_norm;
    }
    if (__builtin_expect(are_inside != 0, 0)) {
      const Lanes squared = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
      e[query.shortest] = squared < 1e-300 ? all(centre_offset) : e[query.shortest];
      const Inside in(A, e);
      h = inside ? in.value - radius : h;
      for (int i = 0; i < 3; ++i) {
        g[i] = inside ? in.gradient[i] : g[i];
      }
    }
    rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2];
    after = h + group.horizon * rate;
    if (count < width) {
      const auto is_chosen = lane_numbers() < count;
      h = is_chosen ? h : all(__builtin_inf());
      after = is_chosen ? after : all(__builtin_inf());
    }
  }

  /// d²h/dt², with the acceleration of the points in the ellipsoid's moving axes.
  Lanes curvature(const Query& query) const noexcept {
    const double* A = query.squared_axes;
    const double* B = query.bias_angular;
    const double* W = query.angular;
    Lanes bend = out.bend(A, v, inverse_norm);
    if (__builtin_expect(are_inside != 0, 0)) {
      bend = inside ? Inside(A, e).bend(A, v, rate) : bend;
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const Lanes a = -query.bias_linear[i] - (B[j] * e[l] - B[l] * e[j]) - (W[j] * (v[l] + s[l]) - W[l] * (v[j] + s[j]));
      bend += g[i] * a;
    }
    return bend;
  }
};

/// Lowers `least` to values below limits, of points.
void lower(double& least, int& point, Lanes limits, Lanes values, const int* points) noexcept {
  for (unsigned lanes = below(values, limits) & below(values, all(least)); lanes != 0; lanes &= lanes - 1) {
    const int i = __builtin_ctz(lanes);
    if (values[i] < least) {
      least = values[i];
      point = points[i];
    }
  }
}

/// Old sums become smaller where what they are relative to becomes so.
void rescale(Query& query, int first, int last, double before, double now, double inverse_T) noexcept {
  if (now < before && before < __builtin_inf()) {
    const Lanes factor = decay(before - now, inverse_T);
    for (int i = first; i < last; ++i) {
      store(query.lane_sums[i], factor * load(query.lane_sums[i]));
    }
  }
}

void add(QueryGroup& group, int k, const Samples& at) noexcept {
  Query& query = group.queries[k];
  const double inverse_T = group.inverse_T;
  const Lanes curvature = at.curvature(query);
  Lanes moment[3];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    moment[i] = at.e[j] * at.g[l] - at.e[l] * at.g[j];
  }
  const auto add_to = [&query](int sum, Lanes term) {
    double* sums = query.lane_sums[sum];
    store(sums, load(sums) + term);
  };
  const Lanes above = at.h - query.reference;  // not a number where nothing is within reach
  if (below(above, all(group.window)) != 0) {
    const auto weighs = above < group.window;
    const Lanes over = weighs ? above : Lanes{}, rate = at.rate;
    const Lanes weight = weighs ? exponential(-inverse_T * over) : Lanes{};
    const Lanes weight_dot = -inverse_T * weight * rate;
    const Lanes weight_ddot = inverse_T * weight * (inverse_T * rate * rate - curvature);
    add_to(0, weight);
    add_to(1, weight_dot);
    add_to(2, weight_ddot);
    add_to(3, weight * over);
    add_to(4, weight_dot * over + weight * rate);
    add_to(5, weight_ddot * over + 2.0 * weight_dot * rate + weight * curvature);
    const Lanes zeroth = -inverse_T * weight;
    const Lanes first = weight + zeroth * over;
    for (int i = 0; i < 3; ++i) {
      add_to(6 + i, zeroth * at.g[i]);
      add_to(9 + i, zeroth * moment[i]);
      add_to(12 + i, first * at.g[i]);
      add_to(15 + i, first * moment[i]);
    }
  }
  // Where nothing comes within reach, of what is nearest.
  const Lanes beyond_ahead = at.after - query.ahead;
  const Lanes after = query.ahead < group.reach_ahead ? beyond_ahead : above < group.window ? beyond_ahead : all(__builtin_inf());
  if (below(after, all(group.window_ahead)) != 0) {
    const auto weighs = after < group.window_ahead;
    const Lanes weight = weighs ? exponential(weighs ? -inverse_T * after : Lanes{}) : Lanes{};
    add_to(approach, weight);
    add_to(approach + 1, weight * (weighs ? at.h : Lanes{}));
    add_to(approach + 2, weight * at.rate);
    add_to(approach + 3, weight * curvature);
    for (int i = 0; i < 3; ++i) {
      add_to(approach + 4 + i, weight * at.g[i]);
      add_to(approach + 7 + i, weight * moment[i]);
    }
  }
}

void sum_candidates(QueryGroup& group, int k, const Points& points) noexcept {
  Query& query = group.queries[k];
  Candidates& candidates = query.candidates;
  if (!query.begun) {
    begin_sums(group, k);
  }
  for (int i = candidates.size; i < most_candidates && i % singles != 0; ++i) {  // fill up the last register
    candidates.most[0][i] = candidates.most[1][i] = __builtin_inff();
  }
  const auto look = [&](double limit, double limit_ahead, auto&& at) {
    const Chosen chosen(candidates, limit, limit_ahead);
    for (int first = 0; first < chosen.size; first += together * width) {
      Samples samples[together];
      const int size = chosen.size - first, number = size < together * width ? (size + width - 1) / width : together;
      for (int i = 0; i < number; ++i) {
        samples[i].begin(group, k, points, chosen, first + i * width);
      }
      for (int i = 0; i < number; ++i) {
        samples[i].finish(group, k, size - i * width);
      }
      for (int i = 0; i < number; ++i) {
        at(samples[i], chosen.point + first + i * width);
      }
    }
  };
  // The smallest bound from above of candidates that may be it: of h whatever it is, of h + τ h' where h is within the window
  // of the smallest, or h + τ h' within reach.
  const auto smallest = [&](int which, double window_end, double within) {
    const Singles ends = all(static_cast<float>(window_end)), limits = all(static_cast<float>(within));
    Singles least = all(__builtin_inff());
    for (int i = 0; i < candidates.size; i += singles) {
      const Singles h = load(candidates.most[0] + i), bound = load(candidates.most[which] + i);
      least = (h <= ends) | (bound < limits) ? smaller(bound, least) : least;
    }
    float value = least[0];
    for (int i = 1; i < singles; ++i) {
      value = least[i] < value ? least[i] : value;
    }
    return static_cast<double>(value);
  };
  const auto find_nearest = [&](const Samples& at, const int* from) {
    lower(query.reference, query.nearest, all(group.reach), at.h, from);
  };
  const auto find_minded = [&](const Samples& at, const int* from) {
    const Lanes limits = at.h < query.reference + group.window ? all(__builtin_inf()) : all(group.reach_ahead);
    lower(query.ahead, query.minded, limits, at.after, from);
  };
  const double reference = query.reference, ahead = query.ahead;
  const auto rescale_both = [&] {
    rescale(query, 0, approach, reference, query.reference, group.inverse_T);
    rescale(query, approach, sums, ahead, query.ahead, group.inverse_T);
  };
  const double nothing = -__builtin_inf(), everything = __builtin_inf();
  if (candidates.size <= width) {
    look(everything, everything, [&](const Samples& at, const int* from) {
      find_nearest(at, from);
      find_minded(at, from);
      rescale_both();
      add(group, k, at);
    });
  } else {
    look(smallest(0, everything, everything), nothing, find_nearest);
    look(nothing, smallest(1, query.reference + group.window, group.reach_ahead), find_minded);
    rescale_both();
    const bool within = query.reference < __builtin_inf();
    look(within ? query.reference + group.window : nothing, query.ahead + group.window_ahead,
         [&](const Samples& at, const int*) { add(group, k, at); });
  }
  candidates.size = 0;
}

/// How far a box lies away along one axis.
inline Singles beyond(Singles x, float half) noexcept {
  return x > half ? x - half : x < -half ? x + half : Singles{};
}

bool collect(QueryGroup& group, const Points& points, int leaf_number, int count) noexcept {
  const Leaf leaf(points, leaf_number, count);
  const Boxes& boxes = points.leaf_boxes;
  bool changed = false;
  // The link's point at the centre of the leaf moves by v, at others of the leaf by a little more.
  const LinkMotion& link = *group.link;
  const double v[3] = {link.linear[0] + link.angular[1] * leaf.z - link.angular[2] * leaf.y,
                       link.linear[1] + link.angular[2] * leaf.x - link.angular[0] * leaf.z,
                       link.linear[2] + link.angular[0] * leaf.y - link.angular[1] * leaf.x};
  const float vx = static_cast<float>(v[0]), vy = static_cast<float>(v[1]), vz = static_cast<float>(v[2]);
  const float speed = __builtin_sqrtf(vx * vx + vy * vy + vz * vz);
  const float more = static_cast<float>(link.turning * leaf.radius + group.fastest) + rate_error * speed;
  const float at[3] = {static_cast<float>(leaf.x - group.origin[0]), static_cast<float>(leaf.y - group.origin[1]),
                       static_cast<float>(leaf.z - group.origin[2])};
  const float ball = static_cast<float>(leaf.radius), largest = static_cast<float>(boxes.radius[leaf_number]);
  const float* R = link.to_link;
  for (int first = 0; first < group.size; first += singles) {
    const Singles x = at[0] - load(group.offset[0] + first), y = at[1] - load(group.offset[1] + first),
                  z = at[2] - load(group.offset[2] + first), extent = load(group.extent + first);
    const Singles squared = x * x + y * y + z * z;
    const Singles inverse_distance = inverse_root(squared > 1e-30f ? squared : all(1e-30f));
    const Singles distance = squared * inverse_distance, radius = extent + ball;
    // All of the box lies beyond the plane across the shortest way to it, and the ellipsoid reaches √(xᵀ S x)/|x| along it.
    const Singles to_box[3] = {beyond(x, static_cast<float>(boxes.half_x[leaf_number])),
                               beyond(y, static_cast<float>(boxes.half_y[leaf_number])),
                               beyond(z, static_cast<float>(boxes.half_z[leaf_number]))};
    Singles in_link[3], squared_to_box = {};
    for (int i = 0; i < 3; ++i) {
      squared_to_box += to_box[i] * to_box[i];
      in_link[i] = R[3 * i] * to_box[0] + R[3 * i + 1] * to_box[1] + R[3 * i + 2] * to_box[2];
    }
    const auto shape = [&](int i) { return load(group.shapes + i * most_queries + first); };
    const Singles product =
        in_link[0] * (in_link[0] * shape(0) + 2.0f * (in_link[1] * shape(1) + in_link[2] * shape(2))) +
        in_link[1] * (in_link[1] * shape(3) + 2.0f * in_link[2] * shape(4)) + in_link[2] * in_link[2] * shape(5);
    const Singles inverse_to_box = inverse_root(larger(squared_to_box, all(1e-30f)));
    const Singles beyond_box = (squared_to_box - root(product)) * inverse_to_box;
    const Singles bound = larger(distance - radius, beyond_box - largest) - distance_error * (distance + radius);
    const Singles across[3] = {y * vz - z * vy, z * vx - x * vz, x * vy - y * vx};
    const Singles turning = root(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
    const Singles closing =
        static_cast<float>(group.horizon) *
        (closing_speed(x * vx + y * vy + z * vz, turning, inverse_distance, radius, all(speed)) + more);
    const Singles near = load(group.near_leaf + first), ahead = load(group.ahead_leaf + first), after = bound - closing;
    const auto matters = (bound < near) | (after < ahead);
    const Singles missed = load(group.missed + first), missed_ahead = load(group.missed_ahead + first);
    store(group.missed + first, ~matters & (bound < missed) ? bound : missed);
    store(group.missed_ahead + first, ~matters & (after < missed_ahead) ? after : missed_ahead);
    unsigned lanes = below(bound, near) | below(after, ahead);
    if (lanes == 0) {
      continue;
    }
    const float motion[3] = {vx, vy, vz};
    const LeafPoints in_leaf(points, leaf, link, motion, static_cast<float>(group.horizon));
    for (int n = 0; n < leaf.count; n += singles) {
      Look looks[singles];
      int num_looks = 0;
      for (unsigned left = lanes; left != 0; left &= left - 1) {
        const int k = first + __builtin_ctz(left);
        Look& look = looks[num_looks];
        if (!look.begin(group, k, leaf, in_leaf, n, closing[k - first])) {
          continue;
        }
        if (!group.queries[k].ready) {
          prepare(group, k);
        }
        ++num_looks;
      }
      for (int i = 0; i < num_looks; ++i) {
        looks[i].bound(group);
      }
      for (int i = 0; i < num_looks; ++i) {
        looks[i].refine(group);
      }
      for (int i = 0; i < num_looks; ++i) {
        changed |= looks[i].keep(group, points, leaf, in_leaf);
      }
    }
  }
  return changed;
}

void measure(const MovingBall& cluster, const Balls& nodes, int first, int count, double* bounds, double* after) noexcept {
  const double* w = cluster.angular;
  for (int n = 0; n < count; n += width) {
    const Lanes at[3] = {load(nodes.x + first + n), load(nodes.y + first + n), load(nodes.z + first + n)};
    const Lanes ball = load(nodes.radius + first + n), radius = cluster.radius + ball;
    Lanes x[3], v[3], squared = {}, along = {}, speed = {}, across = {};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      x[i] = at[i] - cluster.centre[i];
      v[i] = cluster.linear[i] + w[j] * at[l] - w[l] * at[j];
      squared += x[i] * x[i];
      along += x[i] * v[i];
      speed += v[i] * v[i];
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const Lanes turned = x[j] * v[l] - x[l] * v[j];
      across += turned * turned;
    }
    const Lanes inverse_distance = inverse_root(larger(squared, all(1e-300))), distance = squared * inverse_distance;
    const Lanes closing = closing_speed(along, quick_root(across), inverse_distance, radius, quick_root(speed)) +
                          cluster.turning * ball + cluster.fastest;
    store(bounds + n, distance - radius);
    store(after + n, distance - radius - cluster.horizon * closing);
  }
}

}  // namespace
}  // namespace sidestep::kernels
