// Included by one file per instruction set, after clearance_kernel.hpp and <immintrin.h> where there is one. Defines
// add_leaf in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"

// Stands for the centre of an ellipsoid, where the clearance has no gradient [m]; far below any size that matters.
constexpr double centre_offset = 1e-9;

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
    query.precisions[i] = group.precisions[k][i];
  }
  const double centre[3] = {group.centre[0][k], group.centre[1][k], group.centre[2][k]};
  express(query, centre, link.angular, link.linear, query.angular, query.linear);
  express(query, centre, link.bias_angular, link.bias_linear, query.bias_angular, query.bias_linear);
  const double* p = query.precisions;
  query.steepest = p[0] >= p[1] && p[0] >= p[2] ? 0 : p[1] >= p[2] ? 1 : 2;
  for (auto& lanes : query.lane_sums) {
    for (double& sum : lanes) {
      sum = 0.0;
    }
  }
  query.ready = true;
}

/// Measured from a smaller reference, the old values are larger by `shift` and the old weights smaller.
void rescale(Query& query, double shift, double inverse_T) noexcept {
  const Lanes decay = exponential(all(shift * inverse_T < 690.0 ? -shift * inverse_T : -690.0));
  const auto move = [&query, decay, shift](int zeroth, int first) {
    double* s0 = query.lane_sums[zeroth];
    double* s1 = query.lane_sums[first];
    store(s1, decay * (load(s1) + shift * load(s0)));
    store(s0, decay * load(s0));
  };
  for (int i = 0; i < 3; ++i) {
    move(i, 3 + i);
  }
  for (int i = 6; i < 12; ++i) {
    move(i, 6 + i);
  }
}

void add_points(QueryGroup& group, int k, const Points& points, const Leaf& leaf) noexcept {
  Query& query = group.queries[k];
  const double* A = query.axes;
  const double* P = query.precisions;
  const bool moving = points.velocity[0] != nullptr;
  for (int n = leaf.first; n < leaf.first + leaf.count; n += width) {
    // The offset e in principal axes, u = P e and the clearance h = (m − √m)/|u| − r with m = e·u.
    const Lanes x = load(points.position[0] + n) - group.centre[0][k];
    const Lanes y = load(points.position[1] + n) - group.centre[1][k];
    const Lanes z = load(points.position[2] + n) - group.centre[2][k];
    Lanes e[3], u[3], w[3];
    for (int i = 0; i < 3; ++i) {
      e[i] = A[3 * i] * x + A[3 * i + 1] * y + A[3 * i + 2] * z;
    }
    const Lanes squared = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    if (__builtin_expect(below(squared, all(1e-300)) != 0, 0)) {
      e[query.steepest] = squared < 1e-300 ? all(centre_offset) : e[query.steepest];
    }
    for (int i = 0; i < 3; ++i) {
      u[i] = P[i] * e[i];
      w[i] = P[i] * u[i];
    }
    const Lanes root_m = root(e[0] * u[0] + e[1] * u[1] + e[2] * u[2]);
    const Lanes inverse_u = 1.0 / root(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    const Lanes value = root_m * (root_m - 1.0) * inverse_u;
    const Lanes h = value - load(points.radius + n);
    if (below(h, all(group.limit[k])) == 0) {
      continue;
    }
    if (below(h, all(query.reference)) != 0) {
      const double before = query.reference;
      const int last = n + width < leaf.first + leaf.count ? width : leaf.first + leaf.count - n;
      for (int i = 0; i < last; ++i) {
        if (h[i] < query.reference) {
          query.reference = h[i];
          query.nearest = n + i;
        }
      }
      if (before < __builtin_inf()) {
        rescale(query, before - query.reference, group.inverse_T);
      }
      const double limit = query.reference + group.window;
      group.limit[k] = limit < group.limit[k] ? limit : group.limit[k];
    }

    // Velocity and acceleration of the point in the ellipsoid's moving axes.
    Lanes s[3], v[3], a[3];
    const double* W = query.angular;
    const double* B = query.bias_angular;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      v[i] = -query.linear[i] - (W[j] * e[l] - W[l] * e[j]);
    }
    if (moving) {
      const Lanes vx = load(points.velocity[0] + n), vy = load(points.velocity[1] + n), vz = load(points.velocity[2] + n);
      for (int i = 0; i < 3; ++i) {
        s[i] = A[3 * i] * vx + A[3 * i + 1] * vy + A[3 * i + 2] * vz;
        v[i] += s[i];
      }
    }
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

    const Lanes inverse_root = 1.0 / root_m;
    const Lanes along_u = (2.0 - inverse_root) * inverse_u;
    const Lanes along_w = value * inverse_u * inverse_u;
    Lanes g[3];
    for (int i = 0; i < 3; ++i) {
      g[i] = along_u * u[i] - along_w * w[i];
    }
    const Lanes rate = g[0] * v[0] + g[1] * v[1] + g[2] * v[2];
    // h |u| = m − √m, differentiated twice.
    Lanes u_dot[3];
    for (int i = 0; i < 3; ++i) {
      u_dot[i] = P[i] * v[i];
    }
    const Lanes m_dot = 2.0 * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]);
    const Lanes m_ddot = 2.0 * (u_dot[0] * v[0] + u_dot[1] * v[1] + u_dot[2] * v[2]);
    const Lanes root_dot = 0.5 * m_dot * inverse_root;
    const Lanes root_ddot = (0.5 * m_ddot - root_dot * root_dot) * inverse_root;
    const Lanes norm_dot = (u[0] * u_dot[0] + u[1] * u_dot[1] + u[2] * u_dot[2]) * inverse_u;
    const Lanes norm_ddot =
        (u_dot[0] * u_dot[0] + u_dot[1] * u_dot[1] + u_dot[2] * u_dot[2] - norm_dot * norm_dot) * inverse_u;
    const Lanes curvature = g[0] * a[0] + g[1] * a[1] + g[2] * a[2] +
                            (m_ddot - root_ddot - 2.0 * rate * norm_dot - value * norm_ddot) * inverse_u;

    // Weights; those beyond the limit, and the padding, are zero.
    const double inverse_T = group.inverse_T;
    const Lanes above = h - query.reference;
    const auto matters = h < group.limit[k];
    const Lanes weight = matters ? exponential(matters ? -inverse_T * above : Lanes{}) : Lanes{};
    const Lanes over = matters ? above : Lanes{};
    const Lanes weight_dot = -inverse_T * weight * rate;
    const Lanes weight_ddot = inverse_T * weight * (inverse_T * rate * rate - curvature);
    const auto add = [&query](int sum, Lanes term) {
      double* at = query.lane_sums[sum];
      store(at, load(at) + term);
    };
    add(0, weight);
    add(1, weight_dot);
    add(2, weight_ddot);
    add(3, weight * over);
    add(4, weight_dot * over + weight * rate);
    add(5, weight_ddot * over + 2.0 * weight_dot * rate + weight * curvature);
    const Lanes zeroth = -inverse_T * weight;
    const Lanes first = weight + zeroth * over;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const Lanes moment = e[j] * g[l] - e[l] * g[j];
      add(6 + i, zeroth * g[i]);
      add(9 + i, zeroth * moment);
      add(12 + i, first * g[i]);
      add(15 + i, first * moment);
    }
  }
}

bool add_leaf(QueryGroup& group, const Points& points, const Leaf& leaf) noexcept {
  bool lower = false;
  for (int first = 0; first < group.size; first += width) {
    const Lanes x = load(group.centre[0] + first) - leaf.x;
    const Lanes y = load(group.centre[1] + first) - leaf.y;
    const Lanes z = load(group.centre[2] + first) - leaf.z;
    const Lanes outside = root(x * x + y * y + z * z) - leaf.spread - load(group.extent + first);
    const Lanes bound = (outside < 0.0 ? outside : load(group.steepness + first) * outside) - leaf.largest_radius;
    unsigned near = below(bound, load(group.limit + first));
    for (int k = first; near != 0; ++k, near >>= 1) {
      if ((near & 1u) != 0 && k < group.size) {
        if (!group.queries[k].ready) {
          prepare(group, k);
        }
        const double limit = group.limit[k];
        add_points(group, k, points, leaf);
        lower = lower || group.limit[k] < limit;
      }
    }
  }
  return lower;
}

}  // namespace
}  // namespace sidestep::kernels
