// Included inside an anonymous namespace, after kinematics_kernel.inl's Vector. How a link moves with its joint.

// Largest angle [rad]: beyond, the multiples of π/2 below are no longer exact.
constexpr double largest_angle = 1e5;

template <class Numbers>
struct Turn {
  Numbers sine, cosine;
};

/// sin x and cos x within 2 units in the last place of 1: x = n π/2 + r, |r| ≤ π/4, and Taylor in r, its terms in pairs
/// (Estrin), so that they need not wait for each other. For a register of numbers.
template <class Numbers>
inline Turn<Numbers> turn(Numbers x) noexcept {
  using Bits = decltype(x < x);
  const Numbers magic = 0x1.8p52 - Numbers{};  // adding it leaves the nearest integer in the low bits
  const Numbers shifted = x * 0x1.45f306dc9c883p-1 + magic;
  const Numbers n = shifted - magic;
  // π/2 in three parts: the first two products are exact.
  const Numbers r = ((x - n * 0x1.921fb544p+0) - n * 0x1.0b4611a6p-34) - n * 0x1.3198a2e037073p-69;
  const Numbers z = r * r, z2 = z * z, z4 = z2 * z2;
  Numbers s = z * (1.0 / 120.0) - 1.0 / 6.0 + z2 * (z * (1.0 / 362880.0) - 1.0 / 5040.0);
  s += z4 * (z * (1.0 / 6227020800.0) - 1.0 / 39916800.0 + z2 * (-1.0 / 1307674368000.0));
  s = r + r * z * s;
  Numbers c = z * (-1.0 / 720.0) + 1.0 / 24.0 + z2 * (z * (-1.0 / 3628800.0) + 1.0 / 40320.0);
  c += z4 * (z * (-1.0 / 87178291200.0) + 1.0 / 479001600.0 + z2 * (1.0 / 20922789888000.0));
  c = 1.0 + z * (z * c - 0.5);
  // In the quadrant n mod 4: the sine is s, c, −s, −c, the cosine c, −s, −c, s.
  Bits quadrant;
  __builtin_memcpy(&quadrant, &shifted, sizeof quadrant);
  const auto odd = (quadrant & 1) != 0;
  const Numbers sine = odd ? c : s, cosine = odd ? s : c;
  const auto flip = [](Numbers value, Bits sign) noexcept {
    Bits bits;
    __builtin_memcpy(&bits, &value, sizeof bits);
    bits ^= (sign & 2) << 62;
    __builtin_memcpy(&value, &bits, sizeof value);
    return value;
  };
  return {flip(sine, quadrant), flip(cosine, quadrant + 1)};
}

template <class Vector>
struct Motion {
  Vector angular, linear;
};

template <class Vector>
struct Pose {
  Vector rotation[3];  // columns
  Vector position;

  template <class Number>
  Vector rotated(const Number* v) const noexcept {
    return rotation[0] * v[0] + rotation[1] * v[1] + rotation[2] * v[2];
  }
};

template <class Vector>
struct Rates {
  Motion<Vector> velocity, bias;
};

/// From a joint's parent to its child; returns the joint's screw. `turned_x`, `turned_y`: the joint's x and y, turned,
/// in the parent's frame.
template <class Vector, class Number>
inline Motion<Vector> follow(Pose<Vector>& link, const JointModel& joint, const Number* turned_x, const Number* turned_y,
                             Number position) noexcept {
  link.position += link.rotated(joint.translation);
  const Vector axis = link.rotated(joint.axis);
  const Vector x = link.rotated(turned_x), y = link.rotated(turned_y);
  link.rotation[0] = x;
  link.rotation[1] = y;
  link.rotation[2] = axis;
  if (!joint.straight) {
    const Vector columns[3] = {link.rotated(joint.child[0]), link.rotated(joint.child[1]), link.rotated(joint.child[2])};
    for (int k = 0; k < 3; ++k) {
      link.rotation[k] = columns[k];
    }
  }
  const Vector direction = axis * joint.multiplier;
  if (joint.slides) {
    link.position += axis * position;
    return {Vector{}, direction};
  }
  return {direction, cross(link.position, direction)};
}

/// The same for the rates of a joint that moves by `velocity`.
template <class Vector, class Number>
inline void follow(Rates<Vector>& link, const Motion<Vector>& screw, Number velocity) noexcept {
  const Motion<Vector> own{screw.angular * velocity, screw.linear * velocity};
  link.velocity.angular += own.angular;
  link.velocity.linear += own.linear;
  // V × (S q̇), the motion cross product, at the world origin.
  link.bias.angular += cross(link.velocity.angular, own.angular);
  link.bias.linear += sum_of_crosses(link.velocity.angular, own.linear, link.velocity.linear, own.angular);
}
