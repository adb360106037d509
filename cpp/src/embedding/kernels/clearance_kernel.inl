// Included by one file per instruction set, after clearance_kernel.hpp and <immintrin.h> where there is one. Defines
// measure, begin, collect and sum_candidates in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"

#include "clearance_sums.inl"

#include "clearance_looks.inl"

// Of roots, and so of distances and speeds relative to the larger ones that they come from: twice 2⁻¹⁴ and more.
constexpr double measure_error = 2e-4;

/// As Horizon::closing_speed: the angle of n to x is within that of the ball, asin(radius/|x|). `across` is |x × v|. The angle is
/// rather too large: where it is nearly a right one, its cosine feels small errors.
Lanes closing_speed(Lanes along, Lanes across, Lanes inverse_distance, Lanes radius, Lanes speed) noexcept {
  const Lanes sine = (1.0 + measure_error) * radius * inverse_distance, cosine = rough_root(1.0 - sine * sine);
  const Lanes turned = (along * cosine + across * sine) * inverse_distance;
  return (sine < 1.0) & (along * inverse_distance < speed * cosine) ? turned : speed;
}

unsigned measure(const MovingBall& cluster, const Balls& balls, const Boxes& boxes, int first, int count,
                 const Limits& within, const Limits& beyond, double* bounds) noexcept {
  const double* w = cluster.angular;
  const double *centres[3] = {balls.x + first, balls.y + first, balls.z + first},
               *halves[3] = {boxes.half_x + first, boxes.half_y + first, boxes.half_z + first};
  unsigned bits = 0;
  for (int n = 0; n < count; n += width) {
    const Lanes at[3] = {load(centres[0] + n), load(centres[1] + n), load(centres[2] + n)};
    const Lanes ball = load(balls.radius + first + n), radius = cluster.radius + ball;
    Lanes x[3], v[3], squared = {}, squared_to_box = {}, along = {}, squared_speed = {};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      x[i] = at[i] - cluster.centre[i];
      v[i] = cluster.linear[i] + w[j] * at[l] - w[l] * at[j];
      squared += x[i] * x[i];
      along += x[i] * v[i];
      squared_speed += v[i] * v[i];
      const Lanes to_box = larger(magnitude(x[i]) - load(halves[i] + n), Lanes{});
      squared_to_box += to_box * to_box;
    }
    const Lanes inverse_distance = rough_inverse_root(larger(squared, all(1e-300))), distance = squared * inverse_distance;
    const Lanes across = rough_root(squared * squared_speed - along * along);
    const Lanes speed = rough_root(squared_speed);
    const Lanes closing = closing_speed(along, across, inverse_distance, radius, speed) + 4.0 * measure_error * speed +
                          cluster.turning * ball + cluster.fastest;
    const Lanes to_ball = distance - ball, to_box = rough_root(squared_to_box) - load(boxes.radius + first + n);
    const Lanes bound = larger(to_ball, to_box) - cluster.radius - measure_error * distance;
    store(bounds + n, bound);
    const Lanes after = bound - cluster.horizon * closing;
    bits |= (below(bound, all(beyond.near)) | below(after, all(beyond.ahead))) << n;
    bits |= (below(bound, all(within.near)) | below(after, all(within.ahead))) << (n + 16);
  }
  return bits & ((1u << count) - 1u) * 0x10001u;
}

}  // namespace
}  // namespace sidestep::kernels
