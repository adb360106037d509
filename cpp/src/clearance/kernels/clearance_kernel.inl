// Included by one file per instruction set, after clearance_kernel.hpp and intrinsics.hpp. Defines
// measure, measure_points, begin, collect and sum_candidates in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "../../math/kernels/simd.inl"

#include "clearance_sums.inl"

#include "point_tree_bounds.inl"

// Error of roots, and so of distances and speeds, relative to the larger ones that they come from.
constexpr float measure_error = 3.0f * rough_error;

/// What is known of balls around places: the distance of a place, and h and h + τ h' of what is within, at least. A way
/// z between cluster and ball that turns from x by θ is longer than the shortest by |x| (|x| − r) / (2 r) sin²θ, with r
/// for both radii; of the cluster's speed there it has the part along x by cos θ and the part across x by sin θ.
struct Measured {
  Singles distance, fastest, room;  // room: of h + τ h'; fastest: −h', at most

  /// Places at offsets from the cluster's centre.
  Measured(const MovingBall& cluster, const Singles* offset, Singles ball) noexcept {
    const float* w = cluster.angular;
    const float horizon = cluster.horizon;
    const Singles radius = cluster.radius + ball;
    Singles squared = {}, along = {}, squared_speed = {};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const Singles v = cluster.velocity[i] + (w[j] * offset[l] - w[l] * offset[j]);
      squared += offset[i] * offset[i];
      along += offset[i] * v;
      squared_speed += v * v;
    }
    const Singles inverse_distance = rough_inverse_root(larger(squared, all(tiny)));
    distance = squared * inverse_distance;
    const Singles speed = rough_root(squared_speed), towards = along * inverse_distance;
    const Singles more = 4.0f * measure_error * speed + cluster.turning * ball + cluster.fastest;
    fastest = speed + more;
    const Singles apart = (1.0f - measure_error) * distance - radius;
    // squared
    const Singles across = larger((1.0f + 2.0f * measure_error) * squared_speed - towards * towards, Singles{});
    const Singles growth = distance * apart * (0.5f - measure_error) * rough_inverse(radius) +
                           (1.0f + measure_error) * horizon * smaller(towards, Singles{});
    room = ((apart > 0.0f) & (growth > 0.0f)) ? apart - horizon * (towards + more) -
                                                    (0.25f + measure_error) * horizon * horizon * across * rough_inverse(growth)
                                              : all(-__builtin_inff());
  }

  /// As bits, see ClearanceKernel::measure.
  unsigned below(const MovingBall& cluster, Singles bound, const Limits& within, const Limits& beyond) const noexcept {
    // Inside nothing is known.
    const Singles after = bound > 0.0f ? larger(bound - cluster.horizon * fastest, room) : all(-__builtin_inff());
    const auto are_below = [&](const Limits& limits) {
      return kernels::below(bound, all(limits.near)) | kernels::below(after, all(limits.ahead));
    };
    return are_below(beyond) | are_below(within) << 16;
  }
};

/// Where squares overflow, as beyond 1e19 m, nothing is known: what is near may be in the same node.
Singles known(Singles bound) noexcept { return larger(bound, all(-__builtin_inff())); }

unsigned measure(const MovingBall& cluster, const Balls& balls, const Boxes& boxes, int first, int count, const Limits& within,
                 const Limits& beyond, float* bounds) noexcept {
  unsigned bits = 0;
  for (int n = 0; n < count; n += singles) {
    const int from = first + n;
    const Singles offset[3] = {narrow(balls.x + from, cluster.centre[0]), narrow(balls.y + from, cluster.centre[1]),
                               narrow(balls.z + from, cluster.centre[2])};
    const Singles half[3] = {narrow(boxes.half_x + from), narrow(boxes.half_y + from), narrow(boxes.half_z + from)};
    const Singles ball = narrow(balls.radius + from);
    const Measured measured(cluster, offset, ball);
    Singles squared_to_box = {};
    for (int i = 0; i < 3; ++i) {
      const Singles to_box = larger(magnitude(offset[i]) - half[i], Singles{});
      squared_to_box += to_box * to_box;
    }
    const Singles to_ball = measured.distance - ball, to_box = rough_root(squared_to_box) - narrow(boxes.radius + from);
    const Singles bound = known(larger(to_ball, to_box) - cluster.radius - measure_error * measured.distance);
    store(bounds + n, bound);
    bits |= measured.below(cluster, bound, within, beyond) << n;
  }
  return bits & ((1u << count) - 1u) * 0x10001u;
}

unsigned measure_points(const MovingBall& cluster, const Points& points, int first, int count, const Limits& within,
                        const Limits& beyond) noexcept {
  unsigned bits = 0;
  for (int n = 0; n < count; n += singles) {
    const int from = first + n;
    const Singles offset[3] = {narrow(points.position[0] + from, cluster.centre[0]),
                               narrow(points.position[1] + from, cluster.centre[1]),
                               narrow(points.position[2] + from, cluster.centre[2])};
    const Singles ball = narrow(points.radius + from);
    const Measured measured(cluster, offset, ball);
    const Singles bound = known(measured.distance * (1.0f - measure_error) - ball - cluster.radius);
    bits |= measured.below(cluster, bound, within, beyond) << n;
  }
  return bits & ((1u << count) - 1u) * 0x10001u;
}

}  // namespace
}  // namespace sidestep::kernels
