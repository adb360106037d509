// Included by one file per instruction set, after clearance_kernel.hpp and <immintrin.h> where there is one. Defines
// measure, measure_points, begin, collect and sum_candidates in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "../../kinematics/kernels/lanes.inl"

#include "clearance_sums.inl"

#include "clearance_looks.inl"

// Of roots, and so of distances and speeds relative to the larger ones that they come from: twice 2⁻¹⁴ and more.
constexpr double measure_error = 2e-4;

/// What is known of balls around places: the distance of a place, how fast the cluster moves against what is there, at most,
/// and h + τ h', at least. A way z between the balls that turns from x by θ is longer than the shortest by |x| (|x| − r) / (2 r)
/// sin²θ, with r for both radii; along and across x the cluster moves by −z' there, of which z closes in by cos θ and sin θ.
struct Measured {
  Lanes x[3], distance, fastest, room;

  Measured(const MovingBall& cluster, const Lanes* at, Lanes ball) noexcept {
    const double* w = cluster.angular;
    const Lanes radius = cluster.radius + ball;
    Lanes squared = {}, along = {}, squared_speed = {};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      x[i] = at[i] - cluster.centre[i];
      const Lanes v = cluster.linear[i] + w[j] * at[l] - w[l] * at[j];
      squared += x[i] * x[i];
      along += x[i] * v;
      squared_speed += v * v;
    }
    const Lanes inverse_distance = rough_inverse_root(larger(squared, all(1e-300)));
    distance = squared * inverse_distance;
    const Lanes across = rough_root(squared * squared_speed - along * along), speed = rough_root(squared_speed);
    const Lanes more = 4.0 * measure_error * speed + cluster.turning * ball + cluster.fastest;
    fastest = speed + more;
    const Lanes apart = (1.0 - measure_error) * distance - radius, towards = along * inverse_distance;
    const Lanes aside = cluster.horizon * across * inverse_distance;
    const Lanes growth = distance * apart * (0.5 - measure_error) * inverse(radius) + cluster.horizon * smaller(towards, Lanes{});
    room = (apart > 0.0) & (growth > 0.0)
               ? apart - cluster.horizon * (towards + more) - (0.25 + measure_error) * aside * aside * inverse(growth)
               : all(-__builtin_inf());
  }

  /// As bits, see ClearanceKernel::measure.
  unsigned below(const MovingBall& cluster, Lanes bound, const Limits& within, const Limits& beyond) const noexcept {
    // Inside nothing is known.
    const Lanes after = bound > 0.0 ? larger(bound - cluster.horizon * fastest, room) : all(-__builtin_inf());
    return (kernels::below(bound, all(beyond.near)) | kernels::below(after, all(beyond.ahead))) |
           (kernels::below(bound, all(within.near)) | kernels::below(after, all(within.ahead))) << 16;
  }
};

unsigned measure(const MovingBall& cluster, const Balls& balls, const Boxes& boxes, int first, int count,
                 const Limits& within, const Limits& beyond, double* bounds) noexcept {
  unsigned bits = 0;
  for (int n = 0; n < count; n += width) {
    const int from = first + n;
    const Lanes at[3] = {load(balls.x + from), load(balls.y + from), load(balls.z + from)}, ball = load(balls.radius + from);
    const Lanes half[3] = {load(boxes.half_x + from), load(boxes.half_y + from), load(boxes.half_z + from)};
    const Measured measured(cluster, at, ball);
    Lanes squared_to_box = {};
    for (int i = 0; i < 3; ++i) {
      const Lanes to_box = larger(magnitude(measured.x[i]) - half[i], Lanes{});
      squared_to_box += to_box * to_box;
    }
    const Lanes to_ball = measured.distance - ball, to_box = rough_root(squared_to_box) - load(boxes.radius + from);
    const Lanes bound = larger(to_ball, to_box) - cluster.radius - measure_error * measured.distance;
    store(bounds + n, bound);
    bits |= measured.below(cluster, bound, within, beyond) << n;
  }
  return bits & ((1u << count) - 1u) * 0x10001u;
}

unsigned measure_points(const MovingBall& cluster, const Points& points, int first, int count, const Limits& within,
                        const Limits& beyond) noexcept {
  unsigned bits = 0;
  for (int n = 0; n < count; n += width) {
    const int from = first + n;
    const Lanes at[3] = {load(points.position[0] + from), load(points.position[1] + from), load(points.position[2] + from)};
    const Lanes ball = load(points.radius + from);
    const Measured measured(cluster, at, ball);
    bits |= measured.below(cluster, measured.distance * (1.0 - measure_error) - ball - cluster.radius, within, beyond) << n;
  }
  return bits & ((1u << count) - 1u) * 0x10001u;
}

}  // namespace
}  // namespace sidestep::kernels
