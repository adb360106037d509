// Included by one file per instruction set, after clearance_kernel.hpp and <immintrin.h> where there is one. Defines
// find_in_leaf and add_leaf in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"

// Stands for the centre of an ellipsoid, where the clearance has no gradient [m]; far below any size that matters.
constexpr double centre_offset = 1e-9;

// √S is 1 at the foot of the perpendicular; the iteration ends above by rounding, after at most 6 steps for semi-axes of
// a ratio up to 6, and 8 up to 24.
constexpr double converged = 1.0 + 1e-14;
constexpr int most_iterations = 16;

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

void prepare(QueryGroup& group, int k) noexcept {
  Query& query = group.queries[k];
  const double* axes_T = group.axes_T[k];
  const LinkMotion& link = *group.link;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {  // axes_T R_WLᵀ
      query.axes[3 * i + j] = axes_T[i] * link.rotation[j] + axes_T[3 + i] * link.rotation[3 + j] +
                              axes_T[6 + i] * link.rotation[6 + j];
    }
    query.semi_axes[i] = group.semi_axes[k][i];
    query.squared_axes[i] = query.semi_axes[i] * query.semi_axes[i];
  }
  const double centre[3] = {group.centre[0][k], group.centre[1][k], group.centre[2][k]};
  express(query, centre, link.angular, link.linear, query.angular, query.linear);
  express(query, centre, link.bias_angular, link.bias_linear, query.bias_angular, query.bias_linear);
  const double* A = query.squared_axes;
  query.shortest = A[0] <= A[1] && A[0] <= A[2] ? 0 : A[1] <= A[2] ? 1 : 2;
  for (auto& lanes : query.lane_sums) {
    for (double& sum : lanes) {
      sum = 0.0;
    }
  }
  query.ready = true;
}

/// Old weights are smaller by the exponential of this.
Lanes decay(double shift, double inverse_T) noexcept {
  return exponential(all(shift * inverse_T < 690.0 ? -shift * inverse_T : -690.0));
}

/// As Horizon::closing_speed: the angle of n to x is within that of the ball, asin(radius/|x|).
inline Lanes closing_speed(Lanes along, Lanes distance, Lanes radius, Lanes speed) noexcept {
  const Lanes inverse = 1.0 / distance, sine = radius * inverse;
  const Lanes squared = 1.0 - sine * sine, cosine = root(squared > 0.0 ? squared : Lanes{});
  const Lanes component = along * inverse, across = speed * speed - component * component;
  const Lanes turned = component * cosine + root(across > 0.0 ? across : Lanes{}) * sine;
  return sine < 1.0 ? (component < speed * cosine ? turned : speed) : speed;
}

/// Points outside an ellipsoid with squared semi-axes A, seen from it: w = e / (A + t) with t > 0 where Σ A w² = 1.
struct Outside {
  Lanes t, inverse[3], w[3], flatness, inverse_norm;  // 1 / (A + t), Σ A w² / (A + t), 1 / |w|

  /// n' · v, of points that move by v.
  Lanes bend(const double* A, const Lanes* v) const noexcept {
    const Lanes t_dot =
        (A[0] * w[0] * inverse[0] * v[0] + A[1] * w[1] * inverse[1] * v[1] + A[2] * w[2] * inverse[2] * v[2]) / flatness;
    Lanes along = {}, squared = {}, across = {};
    for (int i = 0; i < 3; ++i) {
      const Lanes w_dot = (v[i] - w[i] * t_dot) * inverse[i];
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

enum class Pass { find, add };

void lower(double& limit, double& least, int& point, Lanes values, int first) noexcept {
  if (below(values, all(limit)) != 0) {
    for (int i = 0; i < width; ++i) {
      if (values[i] < limit) {
        limit = least = values[i];
        point = first + i;
      }
    }
  }
}

/// `closing_of_leaf` [m] bounds what any of the points closes within the horizon.
template <Pass pass>
void look_at_points(QueryGroup& group, int k, const Points& points, const Leaf& leaf, double closing_of_leaf) noexcept {
  Query& query = group.queries[k];
  const double* R = query.axes;
  const double* A = query.squared_axes;
  const bool moving = points.velocity[0] != nullptr;
  for (int n = leaf.first; n < leaf.first + leaf.count; n += width) {
    const Lanes x = load(points.position[0] + n) - group.centre[0][k];
    const Lanes y = load(points.position[1] + n) - group.centre[1][k];
    const Lanes z = load(points.position[2] + n) - group.centre[2][k];
    const Lanes radius = load(points.radius + n);
    const double near = group.near[k], near_after = group.ahead[k] + closing_of_leaf;
    const Lanes limit = (near > near_after ? near : near_after) + group.extent[k] + radius;
    if (below(x * x + y * y + z * z, limit > 0.0 ? limit * limit : Lanes{}) == 0) {
      continue;
    }
    Lanes e[3], s[3], v[3];  // the offset in principal axes, and the velocities of the point, there and in moving axes
    for (int i = 0; i < 3; ++i) {
      e[i] = R[3 * i] * x + R[3 * i + 1] * y + R[3 * i + 2] * z;
    }
    const double* W = query.angular;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      v[i] = -query.linear[i] - (W[j] * e[l] - W[l] * e[j]);
    }
    if (moving) {
      const Lanes vx = load(points.velocity[0] + n), vy = load(points.velocity[1] + n), vz = load(points.velocity[2] + n);
      for (int i = 0; i < 3; ++i) {
        s[i] = R[3 * i] * vx + R[3 * i + 1] * vy + R[3 * i + 2] * vz;
        v[i] += s[i];
      }
    }
    // From below: the clearance of the ball around the ellipsoid, and what may be closed within the horizon.
    const Lanes distance = root(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    const Lanes speed = root(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const Lanes along = -(e[0] * v[0] + e[1] * v[1] + e[2] * v[2]);
    const Lanes closing = group.horizon * closing_speed(along, distance, all(group.extent[k]), speed);
    const auto matter = [&](Lanes clearance) noexcept {
      return below(clearance, all(group.near[k])) | below(clearance - closing, all(group.ahead[k]));
    };
    if (matter(distance - group.extent[k] - radius) == 0) {
      continue;
    }

    // t from below. Newton's iteration on 1/√S − 1, which is concave in t, stays below; and so does t |w| below h. It begins
    // at the best of where it comes to from infinity and, along every axis, of that axis alone.
    Outside out;
    Lanes second = {}, fourth = {};
    for (int i = 0; i < 3; ++i) {
      const Lanes term = A[i] * e[i] * e[i];
      second += term;
      fourth += A[i] * term;
    }
    const Lanes from_infinity = root(second) - fourth / second;  // not a number at the centre
    out.t = from_infinity > 0.0 ? from_infinity : Lanes{};
    for (int i = 0; i < 3; ++i) {
      const Lanes least = query.semi_axes[i] * magnitude(e[i]) - A[i];
      out.t = least > out.t ? least : out.t;
    }
    Lanes S, h;
    const auto update = [&]() noexcept {
      Lanes squared = {};
      S = out.flatness = Lanes{};
      for (int i = 0; i < 3; ++i) {
        out.inverse[i] = 1.0 / (A[i] + out.t);
        out.w[i] = e[i] * out.inverse[i];
        const Lanes term = A[i] * out.w[i] * out.w[i];
        S += term;
        out.flatness += term * out.inverse[i];
        squared += out.w[i] * out.w[i];
      }
      const Lanes norm = root(squared);
      out.inverse_norm = 1.0 / norm;
      h = out.t * norm - radius;
    };
    update();
    // S = 1 but for rounding at a first t > 0 that is exact, of points on an axis: they are outside.
    const Lanes S_if_inside = out.t > 0.0 ? all(1.0) : S;
    const auto inside = S_if_inside < 1.0;
    const unsigned any_inside = below(S_if_inside, all(1.0));
    if ((any_inside | matter(h)) == 0) {
      continue;
    }
    for (int i = 0; i < most_iterations; ++i) {
      const Lanes root_S = root(S);
      if ((below(all(converged), root_S) & (matter(h) | any_inside)) == 0) {
        break;
      }
      const Lanes step = S * (root_S - 1.0) / out.flatness;
      out.t += step > 0.0 ? step : Lanes{};
      update();
    }
    Lanes g[3];
    for (int i = 0; i < 3; ++i) {
      g[i] = out.w[i] * out.inverse_norm;
    }
    if (__builtin_expect(any_inside != 0, 0)) {
      const Lanes squared = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
      e[query.shortest] = squared < 1e-300 ? all(centre_offset) : e[query.shortest];
      const Inside in(A, e);
      h = inside ? in.value - radius : h;
      for (int i = 0; i < 3; ++i) {
        g[i] = inside ? in.gradient[i] : g[i];
      }
    }
    if (matter(h) == 0) {
      continue;
    }
    const Lanes rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2];
    const Lanes ahead = h + group.horizon * rate;
    if constexpr (pass == Pass::find) {
      // No lower than what the bounds say: inside an ellipsoid gradients are longer than one, and a point that the second
      // pass does not look at again must not be what the sums are relative to.
      const Lanes least = h - closing;
      lower(group.near[k], query.reference, query.nearest, h, n);
      lower(group.ahead[k], query.ahead, query.minded, ahead < least ? least : ahead, n);
      continue;
    }

    // The acceleration of the point in the ellipsoid's moving axes.
    Lanes a[3];
    const double* B = query.bias_angular;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      a[i] = -query.bias_linear[i] - (B[j] * e[l] - B[l] * e[j]) - (W[j] * v[l] - W[l] * v[j]);
    }
    if (moving) {
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        a[i] -= W[j] * s[l] - W[l] * s[j];
      }
    }
    Lanes bend = out.bend(A, v);
    if (__builtin_expect(any_inside != 0, 0)) {
      bend = inside ? Inside(A, e).bend(A, v, rate) : bend;
    }
    const Lanes curvature = g[0] * a[0] + g[1] * a[1] + g[2] * a[2] + bend;

    const double inverse_T = group.inverse_T;
    Lanes moment[3];
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      moment[i] = e[j] * g[l] - e[l] * g[j];
    }
    const auto add = [&query](int sum, Lanes term) {
      double* at = query.lane_sums[sum];
      store(at, load(at) + term);
    };
    // Weights; those beyond the window, and the padding, are zero.
    if (below(h, all(group.near[k])) != 0) {
      const Lanes above = h - query.reference;
      const auto matters = above < group.window;
      const Lanes weight = matters ? exponential(matters ? -inverse_T * above : Lanes{}) : Lanes{};
      const Lanes over = matters ? above : Lanes{};
      const Lanes weight_dot = -inverse_T * weight * rate;
      const Lanes weight_ddot = inverse_T * weight * (inverse_T * rate * rate - curvature);
      add(0, weight);
      add(1, weight_dot);
      add(2, weight_ddot);
      add(3, weight * over);
      add(4, weight_dot * over + weight * rate);
      add(5, weight_ddot * over + 2.0 * weight_dot * rate + weight * curvature);
      const Lanes zeroth = -inverse_T * weight;
      const Lanes first = weight + zeroth * over;
      for (int i = 0; i < 3; ++i) {
        add(6 + i, zeroth * g[i]);
        add(9 + i, zeroth * moment[i]);
        add(12 + i, first * g[i]);
        add(15 + i, first * moment[i]);
      }
    }
    if (below(ahead, all(query.ahead)) != 0) {  // none has been found below the horizon, or it is inside
      const double before = query.ahead;
      for (int i = 0; i < width; ++i) {
        query.ahead = ahead[i] < query.ahead ? ahead[i] : query.ahead;
      }
      if (before < __builtin_inf()) {
        const Lanes factor = decay(before - query.ahead, inverse_T);
        for (int i = approach; i < sums; ++i) {
          store(query.lane_sums[i], factor * load(query.lane_sums[i]));
        }
      }
    }
    const Lanes above_ahead = ahead - query.ahead;
    if (below(above_ahead, all(group.window_ahead)) != 0) {
      const auto is_minded = above_ahead < group.window_ahead;
      const Lanes minded = is_minded ? exponential(is_minded ? -inverse_T * above_ahead : Lanes{}) : Lanes{};
      add(approach, minded);
      add(approach + 1, minded * (is_minded ? h : Lanes{}));
      add(approach + 2, minded * (is_minded ? rate : Lanes{}));
      add(approach + 3, minded * (is_minded ? curvature : Lanes{}));
      for (int i = 0; i < 3; ++i) {
        add(approach + 4 + i, minded * g[i]);
        add(approach + 7 + i, minded * moment[i]);
      }
    }
  }
}

/// Squared distance along one axis from a box.
inline Lanes beyond(Lanes x, double half) noexcept {
  const Lanes over = magnitude(x) - half;
  return over > 0.0 ? over * over : Lanes{};
}

/// Returns whether `near` or `ahead` fell.
template <Pass pass>
bool look_at_leaf(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept {
  bool fell = false;
  // The link's point at the centre of the leaf moves by v, at others of the leaf by a little more.
  const LinkMotion& link = *group.link;
  const double v[3] = {link.linear[0] + link.angular[1] * leaf.z - link.angular[2] * leaf.y,
                       link.linear[1] + link.angular[2] * leaf.x - link.angular[0] * leaf.z,
                       link.linear[2] + link.angular[0] * leaf.y - link.angular[1] * leaf.x};
  const auto norm = [](const double* a) noexcept { return __builtin_sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); };
  const double speed = norm(v), more = norm(link.angular) * leaf.radius + group.fastest;
  for (int first = 0; first < group.size; first += width) {
    const Lanes x = leaf.x - load(group.centre[0] + first);
    const Lanes y = leaf.y - load(group.centre[1] + first);
    const Lanes z = leaf.z - load(group.centre[2] + first);
    const Lanes distance = root(x * x + y * y + z * z), extent = load(group.extent + first);
    const Lanes radius = extent + leaf.radius;
    const Lanes from_box = root(beyond(x, leaf.half_x) + beyond(y, leaf.half_y) + beyond(z, leaf.half_z));
    const Lanes of_ball = distance - radius, of_box = from_box - extent - leaf.largest;
    const Lanes bound = of_ball > of_box ? of_ball : of_box;
    const Lanes closing =
        group.horizon * (closing_speed(x * v[0] + y * v[1] + z * v[2], distance, radius, all(speed)) + more);
    unsigned near = below(bound, load(group.near + first)) | below(bound - closing, load(group.ahead + first));
    for (int k = first; near != 0; ++k, near >>= 1) {
      if ((near & 1u) != 0 && k < group.size) {
        if (!group.queries[k].ready) {
          prepare(group, k);
        }
        const double near_before = group.near[k], ahead_before = group.ahead[k];
        look_at_points<pass>(group, k, points, leaf, closing[k - first]);
        fell = fell || group.near[k] < near_before || group.ahead[k] < ahead_before;
      }
    }
  }
  return fell;
}

bool find_in_leaf(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept {
  return look_at_leaf<Pass::find>(group, points, leaf);
}

void add_leaf(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept {
  look_at_leaf<Pass::add>(group, points, leaf);
}

}  // namespace
}  // namespace sidestep::kernels
