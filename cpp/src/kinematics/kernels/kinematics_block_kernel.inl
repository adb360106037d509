// Included by one file per instruction set, after kinematics_kernel.hpp and <immintrin.h> where there is one. Defines
// update_link_block in an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "lanes.inl"
#include "vectors.inl"

#include "link_motion.inl"

/// Where number i of a link at the first state is.
template <class Number>
Number* row(Number* link, int i) noexcept {
  return link + i * most_lanes;
}

/// Of the base, where `link` is null.
Pose<Vectors> read_pose(const double* link) noexcept {
  if (link == nullptr) {
    Pose<Vectors> pose = {};
    pose.rotation[0].x = pose.rotation[1].y = pose.rotation[2].z = all(1.0);
    return pose;
  }
  return {{load_rows(row(link, 0)), load_rows(row(link, 3)), load_rows(row(link, 6))}, load_rows(row(link, position_at))};
}

Motion<Vectors> read_motion(const double* rows) noexcept { return {load_rows(rows), load_rows(row(rows, 3))}; }

Rates<Vectors> read_rates(const double* link) noexcept {
  if (link == nullptr) {
    const Motion<Vectors> none = {};
    return {none, none};
  }
  return {read_motion(row(link, velocity_at)), read_motion(row(link, bias_at))};
}

void write(const Pose<Vectors>& pose, double* link) noexcept {
  for (int i = 0; i < 3; ++i) {
    store_rows(row(link, 3 * i), pose.rotation[i]);
  }
  store_rows(row(link, position_at), pose.position);
}

void write(const Motion<Vectors>& motion, double* rows) noexcept {
  store_rows(rows, motion.angular);
  store_rows(row(rows, 3), motion.linear);
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
  for (int i = 0; i < num; ++i) {
    const JointModel& joint = joints[i];
    double* const link = row(links, i * link_numbers);
    // From memory, although it was computed just now: registers hold half of it.
    const double* const parent = joint.parent < 0 ? nullptr : row(links, joint.parent * link_numbers);
    const Lanes position = load(row(q, joint.coordinate)) * joint.multiplier + joint.offset;
    const Turn<Lanes> by = turn_of(joint, position);
    Lanes turned_x[3], turned_y[3];
    for (int k = 0; k < 3; ++k) {
      turned_x[k] = by.cosine * joint.x[k] + by.sine * joint.y[k];
      turned_y[k] = by.cosine * joint.y[k] - by.sine * joint.x[k];
    }
    Pose<Vectors> pose = read_pose(parent);
    const Motion<Vectors> screw = follow(pose, joint, turned_x, turned_y, position);
    write(pose, link);
    write(screw, row(link, screw_at));
    Rates<Vectors> rates = read_rates(parent);
    follow(rates, screw, load(row(v, joint.coordinate)));
    write(rates.velocity, row(link, velocity_at));
    write(rates.bias, row(link, bias_at));
  }
}

void update_link_block(const JointModel* joints, int num, const double* q, const double* v, double* links) noexcept {
  for (int first = 0; first < most_lanes; first += width) {
    update_some(joints, num, q + first, v + first, links + first);
  }
}

}  // namespace
}  // namespace sidestep::kernels
