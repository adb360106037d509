// Included by one file per instruction set, after clearance_kernel.hpp and <immintrin.h> where there is one. Defines
// measure, begin, collect and sum_candidates in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"

#include "clearance_sums.inl"

#include "clearance_looks.inl"

/// As Horizon::closing_speed: the angle of n to x is within that of the ball, asin(radius/|x|). `across` is |x × v|.
template <class Values>
Values closing_speed(Values along, Values across, Values inverse_distance, Values radius, Values speed) noexcept {
  const Values sine = radius * inverse_distance, cosine = quick_root(1 - sine * sine);
  const Values turned = (along * cosine + across * sine) * inverse_distance;
  return (sine < 1) & (along * inverse_distance < speed * cosine) ? turned : speed;
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
    Lanes x[3], v[3], squared = {}, squared_to_box = {}, along = {}, speed = {}, across = {};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      x[i] = at[i] - cluster.centre[i];
      v[i] = cluster.linear[i] + w[j] * at[l] - w[l] * at[j];
      squared += x[i] * x[i];
      along += x[i] * v[i];
      speed += v[i] * v[i];
      const Lanes to_box = larger(magnitude(x[i]) - load(halves[i] + n), Lanes{});
      squared_to_box += to_box * to_box;
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const Lanes turned = x[j] * v[l] - x[l] * v[j];
      across += turned * turned;
    }
    const Lanes inverse_distance = inverse_root(larger(squared, all(1e-300))), distance = squared * inverse_distance;
    const Lanes closing = closing_speed(along, quick_root(across), inverse_distance, radius, quick_root(speed)) +
                          cluster.turning * ball + cluster.fastest;
    const Lanes bound = larger(distance - radius, quick_root(squared_to_box) - cluster.radius - load(boxes.radius + first + n));
    store(bounds + n, bound);
    const Lanes after = bound - cluster.horizon * closing;
    bits |= (below(bound, all(beyond.near)) | below(after, all(beyond.ahead))) << n;
    bits |= (below(bound, all(within.near)) | below(after, all(within.ahead))) << (n + 16);
  }
  return bits & ((1u << count) - 1u) * 0x10001u;
}

}  // namespace
}  // namespace sidestep::kernels
