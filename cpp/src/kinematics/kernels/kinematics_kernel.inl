// Included by one file per instruction set, after kinematics_kernel.hpp. Defines update_links in an anonymous
// namespace.

namespace sidestep::kernels {
namespace {

// Vectors of three numbers and a fourth that does not count; also sines and cosines of four joints.
typedef double Vector __attribute__((vector_size(32)));
typedef long long Bits __attribute__((vector_size(32)));

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
  return __builtin_shuffle(v, Bits{1, 2, 0, 3});
#endif
}

/// The cross product as (z, x, y): turned, it is the product.
inline Vector turned_cross(Vector a, Vector b) noexcept { return a * turned(b) - turned(a) * b; }

struct Turn {
  Vector sine, cosine;
};

// Beyond this angle [rad] the multiples of π/2 below are no longer exact.
constexpr double largest_angle = 1e5;

/// sin x and cos x within 2 units in the last place of 1: x = n π/2 + r, |r| ≤ π/4, and Taylor in r, its terms in pairs
/// (Estrin), so that they need not wait for each other.
inline Turn turn(Vector x) noexcept {
  const Vector magic = 0x1.8p52 - Vector{};  // adding it leaves the nearest integer in the low bits
  const Vector shifted = x * 0x1.45f306dc9c883p-1 + magic;
  const Vector n = shifted - magic;
  // π/2 in three parts: the first two products are exact.
  const Vector r = ((x - n * 0x1.921fb544p+0) - n * 0x1.0b4611a6p-34) - n * 0x1.3198a2e037073p-69;
  const Vector z = r * r, z2 = z * z, z4 = z2 * z2;
  Vector s = z * (1.0 / 120.0) - 1.0 / 6.0 + z2 * (z * (1.0 / 362880.0) - 1.0 / 5040.0);
  s += z4 * (z * (1.0 / 6227020800.0) - 1.0 / 39916800.0 + z2 * (-1.0 / 1307674368000.0));
  s = r + r * z * s;
  Vector c = z * (-1.0 / 720.0) + 1.0 / 24.0 + z2 * (z * (-1.0 / 3628800.0) + 1.0 / 40320.0);
  c += z4 * (z * (-1.0 / 87178291200.0) + 1.0 / 479001600.0 + z2 * (1.0 / 20922789888000.0));
  c = 1.0 + z * (z * c - 0.5);
  // In the quadrant n mod 4: the sine is s, c, −s, −c, the cosine c, −s, −c, s.
  Bits quadrant;
  __builtin_memcpy(&quadrant, &shifted, sizeof quadrant);
  const auto odd = (quadrant & 1) != 0;
  const Vector sine = odd ? c : s, cosine = odd ? s : c;
  const auto flip = [](Vector value, Bits sign) noexcept {
    Bits bits;
    __builtin_memcpy(&bits, &value, sizeof bits);
    bits ^= (sign & 2) << 62;
    __builtin_memcpy(&value, &bits, sizeof value);
    return value;
  };
  return {flip(sine, quadrant), flip(cosine, quadrant + 1)};
}

struct Motion {
  Vector angular, linear;
};

struct Link {
  Vector rotation[3];  // columns
  Vector position;
  Motion velocity, bias;

  Vector rotated(const double* v) const noexcept {
    return rotation[0] * v[0] + rotation[1] * v[1] + rotation[2] * v[2];
  }
};

Link base() noexcept {
  return {{Vector{1.0}, Vector{0.0, 1.0}, Vector{0.0, 0.0, 1.0}}, Vector{}, {Vector{}, Vector{}}, {Vector{}, Vector{}}};
}

Link read(const double* numbers) noexcept {
  Link link;
  for (int i = 0; i < 3; ++i) {
    link.rotation[i] = load_three(numbers + 3 * i);
  }
  link.position = load_three(numbers + position_at);
  link.velocity = {load_three(numbers + velocity_at), load_three(numbers + velocity_at + 3)};
  link.bias = {load_three(numbers + bias_at), load_three(numbers + bias_at + 3)};
  return link;
}

/// In the order of memory: the fourth number of every vector is overwritten by the next, that of the last goes nowhere.
void write(const Link& link, const Motion& screw, double* numbers) noexcept {
  for (int i = 0; i < 3; ++i) {
    store(numbers + 3 * i, link.rotation[i]);
  }
  store(numbers + position_at, link.position);
  store(numbers + screw_at, screw.angular);
  store(numbers + screw_at + 3, screw.linear);
  store(numbers + velocity_at, link.velocity.angular);
  store(numbers + velocity_at + 3, link.velocity.linear);
  store(numbers + bias_at, link.bias.angular);
  store(numbers + bias_at + 3, link.bias.linear);
}

inline double position(const JointModel& joint, const double* q) noexcept {
  return joint.multiplier * q[joint.coordinate] + joint.offset;
}

// Of a turned joint's x and y, until its link is written there.
constexpr int turned_x = 0, turned_y = 4;

/// Writes the x and y of every joint, turned, in the parent's frame. A loop of its own, so that what goes on from link to
/// link does not wait for it, and reads their numbers from memory, each into all of a register.
void turn_joints(const JointModel* joints, int num, const double* q, double* links, int stride) noexcept {
  for (int first = 0; first < num; first += joint_block) {
    Vector positions;
    for (int k = 0; k < joint_block; ++k) {
      positions[k] = position(joints[first + k], q);
    }
    const Turn turns = turn(positions);
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

void update_links(const JointModel* joints, int num, const double* q, const double* v, double* links,
                  int stride) noexcept {
  turn_joints(joints, num, q, links, stride);
  Link link = base();  // of the joint before, then of this one
  for (int i = 0; i < num; ++i) {
    const JointModel& joint = joints[i];
    double* const numbers = links + i * stride;
    if (joint.parent != i - 1) {
      link = joint.parent < 0 ? base() : read(links + joint.parent * stride);
    }
    link.position += link.rotated(joint.translation);
    const Vector axis = link.rotated(joint.axis);
    const Vector x = link.rotated(numbers + turned_x), y = link.rotated(numbers + turned_y);
    link.rotation[0] = x;
    link.rotation[1] = y;
    link.rotation[2] = axis;
    if (!joint.straight) {
      const Vector columns[3] = {link.rotated(joint.child[0]), link.rotated(joint.child[1]),
                                 link.rotated(joint.child[2])};
      for (int k = 0; k < 3; ++k) {
        link.rotation[k] = columns[k];
      }
    }
    Motion screw{joint.multiplier * axis, turned(turned_cross(link.position, joint.multiplier * axis))};
    if (joint.slides) {
      link.position += position(joint, q) * axis;
      screw = {Vector{}, screw.angular};
    }
    const double velocity = v[joint.coordinate];
    const Motion own{velocity * screw.angular, velocity * screw.linear};
    link.velocity.angular += own.angular;
    link.velocity.linear += own.linear;
    // V × (S q̇), the motion cross product, at the world origin.
    link.bias.angular += turned(turned_cross(link.velocity.angular, own.angular));
    link.bias.linear += turned(turned_cross(link.velocity.angular, own.linear) +
                               turned_cross(link.velocity.linear, own.angular));
    write(link, screw, numbers);
  }
}

}  // namespace
}  // namespace sidestep::kernels
