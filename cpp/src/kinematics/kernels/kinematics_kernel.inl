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

/// sin x and cos x within 2 units in the last place of 1: x = n π/2 + r, |r| ≤ π/4, and Taylor in r.
inline Turn turn(Vector x) noexcept {
  const Vector magic = 0x1.8p52 - Vector{};  // adding it leaves the nearest integer in the low bits
  const Vector shifted = x * 0x1.45f306dc9c883p-1 + magic;
  const Vector n = shifted - magic;
  // π/2 in three parts: the first two products are exact.
  const Vector r = ((x - n * 0x1.921fb544p+0) - n * 0x1.0b4611a6p-34) - n * 0x1.3198a2e037073p-69;
  const Vector z = r * r;
  Vector s = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
  s = s * z - 1.0 / 39916800.0;
  s = s * z + 1.0 / 362880.0;
  s = s * z - 1.0 / 5040.0;
  s = s * z + 1.0 / 120.0;
  s = s * z - 1.0 / 6.0;
  s = r + r * z * s;
  Vector c = z * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
  c = c * z + 1.0 / 479001600.0;
  c = c * z - 1.0 / 3628800.0;
  c = c * z + 1.0 / 40320.0;
  c = c * z - 1.0 / 720.0;
  c = c * z + 1.0 / 24.0;
  c = c * z - 0.5;
  c = c * z + 1.0;
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

constexpr double base[link_numbers] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

struct Link {
  Vector rotation[3];  // columns
  Vector position;
  Motion velocity, bias;

  Vector rotated(Vector v) const noexcept { return rotation[0] * v[0] + rotation[1] * v[1] + rotation[2] * v[2]; }
};

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

void update_links(const JointModel* joints, int num, const double* positions, const double* velocities, double* links,
                  int stride) noexcept {
  Link link;  // of the joint before, then of this one
  Turn turns;
  for (int i = 0; i < num; ++i) {
    const JointModel& joint = joints[i];
    const int at = i % joint_block;
    if (at == 0) {
      turns = turn(load(positions + i));
    }
    double sine = turns.sine[at], cosine = turns.cosine[at];
    if (!(__builtin_fabs(positions[i]) < largest_angle)) {
      sine = __builtin_sin(positions[i]);
      cosine = __builtin_cos(positions[i]);
    }
    if (i == 0 || joint.parent != i - 1) {
      link = read(joint.parent < 0 ? base : links + joint.parent * stride);
    }
    link.position += link.rotated(load(joint.translation));
    const Vector axis = link.rotated(load(joint.axis));
    Vector rotation[3];
    for (int k = 0; k < 3; ++k) {
      rotation[k] = link.rotated(load(joint.fixed[k]) + cosine * load(joint.cosine[k]) + sine * load(joint.sine[k]));
    }
    for (int k = 0; k < 3; ++k) {
      link.rotation[k] = rotation[k];
    }
    Motion screw{joint.multiplier * axis, turned(turned_cross(link.position, joint.multiplier * axis))};
    if (joint.slides) {
      link.position += positions[i] * axis;
      screw = {Vector{}, screw.angular};
    }
    const Motion own{velocities[i] * screw.angular, velocities[i] * screw.linear};
    link.velocity.angular += own.angular;
    link.velocity.linear += own.linear;
    // V × (S q̇), the motion cross product, at the world origin.
    link.bias.angular += turned(turned_cross(link.velocity.angular, own.angular));
    link.bias.linear += turned(turned_cross(link.velocity.angular, own.linear) +
                               turned_cross(link.velocity.linear, own.angular));
    write(link, screw, links + i * stride);
  }
}

}  // namespace
}  // namespace sidestep::kernels
