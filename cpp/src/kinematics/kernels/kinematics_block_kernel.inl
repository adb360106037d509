// Included by one file per instruction set, after kinematics_kernel.hpp and <immintrin.h> where there is one. Defines
// update_link_block in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"
#include "vectors.inl"

#include "link_motion.inl"

Link<Vectors> base() noexcept {
  Link<Vectors> link = {};
  link.rotation[0].x = link.rotation[1].y = link.rotation[2].z = all(1.0);
  return link;
}

/// Where number i of a link at the first state is.
template <class Number>
Number* row(Number* link, int i) noexcept {
  return link + i * most_lanes;
}

Link<Vectors> read(const double* link) noexcept {
  return {{load_rows(row(link, 0)), load_rows(row(link, 3)), load_rows(row(link, 6))},
          load_rows(row(link, position_at)),
          {load_rows(row(link, velocity_at)), load_rows(row(link, velocity_at + 3))},
          {load_rows(row(link, bias_at)), load_rows(row(link, bias_at + 3))}};
}

void write(const Link<Vectors>& link, const Motion<Vectors>& screw, double* numbers) noexcept {
  for (int i = 0; i < 3; ++i) {
    store_rows(row(numbers, 3 * i), link.rotation[i]);
  }
  store_rows(row(numbers, position_at), link.position);
  store_rows(row(numbers, screw_at), screw.angular);
  store_rows(row(numbers, screw_at + 3), screw.linear);
  store_rows(row(numbers, velocity_at), link.velocity.angular);
  store_rows(row(numbers, velocity_at + 3), link.velocity.linear);
  store_rows(row(numbers, bias_at), link.bias.angular);
  store_rows(row(numbers, bias_at + 3), link.bias.linear);
}

Turn<Lanes> turn_of(const JointModel& joint, Lanes position) noexcept {
  if (joint.slides) {
    return {Lanes{}, all(1.0)};
  }
  Turn<Lanes> result = turn(position);
  for (unsigned far = below(all(largest_angle), magnitude(position)); far != 0; far &= far - 1) {
    const int lane = __builtin_ctz(far);
    result.sine[lane] = __builtin_sin(position[lane]);
    result.cosine[lane] = __builtin_cos(position[lane]);
  }
  return result;
}

/// As many states as a register holds, from the first of the rows on.
void update_some(const JointModel* joints, int num, const double* q, const double* v, double* links) noexcept {
  Link<Vectors> link = base();  // of the joint before, then of this one
  for (int i = 0; i < num; ++i) {
    const JointModel& joint = joints[i];
    if (joint.parent != i - 1) {
      link = joint.parent < 0 ? base() : read(links + joint.parent * link_numbers * most_lanes);
    }
    const Lanes position = load(row(q, joint.coordinate)) * joint.multiplier + joint.offset;
    const Turn<Lanes> by = turn_of(joint, position);
    Lanes turned_x[3], turned_y[3];
    for (int k = 0; k < 3; ++k) {
      turned_x[k] = by.cosine * joint.x[k] + by.sine * joint.y[k];
      turned_y[k] = by.cosine * joint.y[k] - by.sine * joint.x[k];
    }
    const Motion<Vectors> screw = follow(link, joint, turned_x, turned_y, position, load(row(v, joint.coordinate)));
    write(link, screw, links + i * link_numbers * most_lanes);
  }
}

void update_link_block(const JointModel* joints, int num, const double* q, const double* v, double* links) noexcept {
  for (int first = 0; first < most_lanes; first += width) {
    update_some(joints, num, q + first, v + first, links + first);
  }
}

}  // namespace
}  // namespace sidestep::kernels
