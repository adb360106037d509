// Included by one file per instruction set, after kinematics_kernel.hpp. Defines update_links in an anonymous
// namespace.

namespace sidestep::kernels {
namespace {

// Vectors of three numbers and a fourth that does not count; also sines and cosines of four joints.
typedef double Vector __attribute__((vector_size(32)));

inline Vector load(const double* p) noexcept {
  Vector v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

inline Vector load_three(const double* p) noexcept { return Vector{p[0], p[1], p[2], 0.0}; }

inline void store(double* p, Vector v) noexcept { __builtin_memcpy(p, &v, sizeof v); }

/// (y, z, x).
inline Vector turned(Vector v) noexcept {
#if defined(__clang__)
  return __builtin_shufflevector(v, v, 1, 2, 0, 3);
#else
  typedef long long Places __attribute__((vector_size(32)));
  return __builtin_shuffle(v, Places{1, 2, 0, 3});
#endif
}

/// The cross product as (z, x, y): turned, it is the product.
inline Vector turned_cross(Vector a, Vector b) noexcept { return a * turned(b) - turned(a) * b; }
inline Vector cross(Vector a, Vector b) noexcept { return turned(turned_cross(a, b)); }
/// a × b + c × d.
inline Vector sum_of_crosses(Vector a, Vector b, Vector c, Vector d) noexcept {
  return turned(turned_cross(a, b) + turned_cross(c, d));
}

#include "link_motion.inl"

struct Link {
  Pose<Vector> pose;
  Rates<Vector> rates;
};

Link base() noexcept {
  return {{{Vector{1.0}, Vector{0.0, 1.0}, Vector{0.0, 0.0, 1.0}}, Vector{}}, {{Vector{}, Vector{}}, {Vector{}, Vector{}}}};
}

Link read(const double* numbers) noexcept {
  Link link;
  for (int i = 0; i < 3; ++i) {
    link.pose.rotation[i] = load_three(numbers + 3 * i);
  }
  link.pose.position = load_three(numbers + position_at);
  link.rates.velocity = {load_three(numbers + velocity_at), load_three(numbers + velocity_at + 3)};
  link.rates.bias = {load_three(numbers + bias_at), load_three(numbers + bias_at + 3)};
  return link;
}

/// In the order of memory: the fourth number of every vector is overwritten by the next, that of the last goes nowhere.
void write(const Link& link, const Motion<Vector>& screw, double* numbers) noexcept {
  for (int i = 0; i < 3; ++i) {
    store(numbers + 3 * i, link.pose.rotation[i]);
  }
  store(numbers + position_at, link.pose.position);
  store(numbers + screw_at, screw.angular);
  store(numbers + screw_at + 3, screw.linear);
  store(numbers + velocity_at, link.rates.velocity.angular);
  store(numbers + velocity_at + 3, link.rates.velocity.linear);
  store(numbers + bias_at, link.rates.bias.angular);
  store(numbers + bias_at + 3, link.rates.bias.linear);
}

inline double position(const JointModel& joint, const double* q) noexcept {
  return joint.multiplier * q[joint.coordinate] + joint.offset;
}

// Places of the x and y axes of a turned joint, until its link is written there.
constexpr int turned_x = 0, turned_y = 4;

/// Writes the x and y of every joint, turned, in the parent's frame. A loop of its own, so that what goes on from link
/// to link does not wait for it, and reads their numbers from memory, each into all of a register.
void turn_joints(const JointModel* joints, int num, const double* q, double* links, int stride) noexcept {
  for (int first = 0; first < num; first += joint_block) {
    Vector positions;
    for (int k = 0; k < joint_block; ++k) {
      positions[k] = position(joints[first + k], q);
    }
    const Turn<Vector> turns = turn(positions);
    for (int k = 0; k < joint_block && first + k < num; ++k) {
      const JointModel& joint = joints[first + k];
      double sine = turns.sine[k], cosine = turns.cosine[k];
      if (joint.slides) {
        sine = 0.0;
        cosine = 1.0;
      } else if (!(__builtin_fabs(positions[k]) < largest_angle)) {
        sine = __builtin_sin(positions[k]);
        cosine = __builtin_cos(positions[k]);
      }
      double* const numbers = links + (first + k) * stride;
      store(numbers + turned_x, cosine * load(joint.x) + sine * load(joint.y));
      store(numbers + turned_y, cosine * load(joint.y) - sine * load(joint.x));
    }
  }
}

void update_links(const JointModel* joints, int num, const double* q, const double* v, double* links, int stride) noexcept {
  turn_joints(joints, num, q, links, stride);
  Link link = base();  // of the joint before, then of this one
  for (int i = 0; i < num; ++i) {
    const JointModel& joint = joints[i];
    double* const numbers = links + i * stride;
    if (joint.parent != i - 1) {
      link = joint.parent < 0 ? base() : read(links + joint.parent * stride);
    }
    const Motion<Vector> screw = follow(link.pose, joint, numbers + turned_x, numbers + turned_y, position(joint, q));
    follow(link.rates, screw, v[joint.coordinate]);
    write(link, screw, numbers);
  }
}

}  // namespace
}  // namespace sidestep::kernels
