#include "sidestep/guard/stop_trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr double rounding = 1e-9;  // Relative excess of a limit that counts as rounding.
// Hold of the longer shape, in ramps: each ramp takes a fifth of the stop, so that a stop bounded by acceleration takes 1.25
// times the shortest.
constexpr int hold_of_ramp = 3;

}  // namespace

StopTrajectory::StopTrajectory(int num_coordinates)
    : shapes_(static_cast<std::size_t>(num_coordinates)),
      shortest_(shapes_),
      passes_(shapes_.size()),
      first_(Eigen::VectorXd::Zero(num_coordinates)),
      hardest_(first_),
      way_(first_) {}

double StopTrajectory::plateau(double v, double a, const Shape& shape, double period) noexcept {
  return (v / period + 0.5 * a * (shape.ramp - 1)) / (shape.ramp + shape.hold);
}

bool StopTrajectory::keeps(double v, double a, double most_a, double most_step, const Shape& shape, double period) noexcept {
  const double p = plateau(v, a, shape, period), step = std::max(std::abs(p + a), std::abs(p));
  return std::abs(p) <= most_a * (1.0 + rounding) && step <= most_step * shape.ramp * (1.0 + rounding);
}

StopTrajectory::Shape StopTrajectory::shortest(double v, double a, double most_a, double most_step, double period,
                                               const Shape& near) noexcept {
  // Of a shape with a hold of `part` ramps the least ramp, looked for from that of a stop before on.
  const auto least = [&](int part) {
    const auto suffices = [&](int ramp) { return keeps(v, a, most_a, most_step, {ramp, part * ramp}, period); };
    int high = std::max(1, near.num_periods() / (2 + part)), stride = 1;
    if (suffices(high)) {
      while (high > 1 && suffices(std::max(1, high - stride))) {
        high = std::max(1, high - stride);
        stride *= 2;
      }
    } else {
      do {
        high += stride;
        stride *= 2;
      } while (high < most_periods && !suffices(high));
    }
    int low = std::max(0, high - std::max(1, stride));
    while (high - low > 1) {
      const int middle = low + (high - low) / 2;
      (suffices(middle) ? high : low) = middle;
    }
    return Shape{high, part * high};
  };
  const Shape triangle = least(0), trapezium = least(hold_of_ramp);
  return trapezium.num_periods() < triangle.num_periods() ? trapezium : triangle;
}

double StopTrajectory::at(Eigen::Index joint, int period) const noexcept {
  const Shape& shape = shapes_[static_cast<std::size_t>(joint)];
  const double a = first_[joint], p = -hardest_[joint];
  const int k = period + 1;
  if (k <= shape.ramp) {
    return a - (p + a) * k / shape.ramp;
  }
  const int left = shape.num_periods() - k;
  return left >= shape.ramp ? -p : left > 0 ? -p * left / shape.ramp : 0.0;
}

double StopTrajectory::place(Eigen::Index joint, int periods) const noexcept {
  const Shape& shape = shapes_[static_cast<std::size_t>(joint)];
  const Passes& at = passes_[static_cast<std::size_t>(joint)];
  const double a = first_[joint], p = -hardest_[joint], T = period_, r = shape.ramp;
  if (periods <= shape.ramp) {
    const double k = periods, up = k * (k + 1.0);
    return at.q + T * (k * at.v + T * up * (0.5 * a - (p + a) * (k + 2.0) / (6.0 * r)));
  }
  if (periods <= shape.ramp + shape.hold) {
    const double k = periods - shape.ramp;
    return at.held_q + T * k * (at.held_v - 0.5 * T * p * (k + 1.0));
  }
  const double k = std::min(periods - shape.ramp - shape.hold, shape.ramp), up = k * (k + 1.0);
  return at.left_q + T * (k * at.left_v - T * p / r * up * (0.5 * r - (k + 2.0) / 6.0));
}

bool StopTrajectory::fits(Eigen::Index joint, double q, double v, double a, const JointLimits& limits, double most_step,
                          double period) noexcept {
  const Shape& shape = shapes_[static_cast<std::size_t>(joint)];
  if (!keeps(v, a, limits.acceleration[joint], most_step, shape, period)) {
    return false;
  }
  const double p = plateau(v, a, shape, period), r = shape.ramp;
  hardest_[joint] = -p;
  const auto speed_in_ramp = [&](double k) { return v + period * (a * k - 0.5 * (p + a) * k * (k + 1.0) / r); };
  Passes& at = passes_[static_cast<std::size_t>(joint)];
  at.q = q;
  at.v = v;
  at.held_v = speed_in_ramp(r);
  at.held_q = place(joint, shape.ramp);
  at.left_v = at.held_v - period * p * shape.hold;
  at.left_q = place(joint, shape.ramp + shape.hold);
  const double end = place(joint, shape.num_periods());
  double low = std::min(q, end), high = std::max(q, end), fastest = std::abs(v);
  // It is fastest where it begins, where its acceleration is gone, or on its way back; that is where the hold begins.
  if (a * (p + a) > 0.0) {
    fastest = std::max(fastest, std::abs(speed_in_ramp(std::min(r, std::floor(a * r / (p + a))))));
  }
  if (p * v < 0.0) {  // it turns back, once: where v + T (a k − (p + a) k (k + 1)/2r) = 0
    const double bend = 0.5 * (p + a) / r, slope = a - bend;
    const double root = std::sqrt(std::max(slope * slope + 4.0 * bend * v / period, 0.0));
    const double turn = std::clamp(bend == 0.0 ? 0.0 : 0.5 * (slope - std::copysign(root, a)) / bend, 0.0, r);
    for (const double k : {std::floor(turn), std::ceil(turn)}) {
      const double there = place(joint, static_cast<int>(k));
      low = std::min(low, there);
      high = std::max(high, there);
    }
    fastest = std::max(fastest, std::abs(at.held_v));
  }
  way_[joint] = std::max(high - q, q - low);
  // Where it is outside already, it goes no farther.
  return low >= std::min(limits.lower[joint], q) - rounding && high <= std::max(limits.upper[joint], q) + rounding &&
         fastest <= std::max(limits.velocity[joint], std::abs(v)) * (1.0 + rounding);
}

bool StopTrajectory::plan(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a, const JointLimits& limits, double period,
                          double jerk_share) noexcept {
  const Eigen::Index nv = first_.size();
  Shape common;
  for (Eigen::Index j = 0; j < nv; ++j) {
    Shape& own = shortest_[static_cast<std::size_t>(j)];
    own = shortest(v[j], a[j], limits.acceleration[j], jerk_share * limits.jerk[j] * period, period, own);
    if (own.num_periods() > common.num_periods()) {
      common = own;
    }
  }
  first_ = a;
  period_ = period;
  passed_ = num_periods_ = 0;
  for (Eigen::Index j = 0; j < nv; ++j) {
    const double step = jerk_share * limits.jerk[j] * period;
    Shape& shape = shapes_[static_cast<std::size_t>(j)];
    shape = common;
    if (!fits(j, q[j], v[j], a[j], limits, step, period)) {
      shape = shortest_[static_cast<std::size_t>(j)];
      if (!fits(j, q[j], v[j], a[j], limits, step, period)) {
        return false;
      }
    }
    num_periods_ = std::max(num_periods_, shape.num_periods());
  }
  return true;
}

void StopTrajectory::acceleration(int periods, Eigen::VectorXd& a) const noexcept {
  for (Eigen::Index j = 0; j < first_.size(); ++j) {
    a[j] = at(j, passed_ + periods);
  }
}

void StopTrajectory::position(int periods, Eigen::VectorXd& q) const noexcept {
  for (Eigen::Index j = 0; j < first_.size(); ++j) {
    q[j] = place(j, passed_ + periods);
  }
}

}  // namespace sidestep
