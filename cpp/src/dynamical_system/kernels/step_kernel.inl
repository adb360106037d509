// Included by one file per instruction set, after step_kernel.hpp and <immintrin.h> where there is one. Defines take_steps in
// an anonymous namespace.

namespace sidestep::kernels {
namespace {

#include "../../kinematics/kernels/lanes.inl"

/// Row j of what begins at `rows`.
inline Lanes at(const double* rows, int j) noexcept { return load(rows + j * most_lanes); }

/// Entry j of gain · x.
template <class Rows>
inline Lanes gained(const double* gain, bool is_diagonal, int num, int j, const Rows& x) noexcept {
  if (is_diagonal) {
    return gain[j] * x(j);
  }
  Lanes sum = {};
  for (int i = 0; i < num; ++i) {
    sum += gain[j * num + i] * x(i);
  }
  return sum;
}

unsigned take_some(const StepModel& model, const StepRows& rows) noexcept {
  const int num = model.num;
  const auto way = [&](int j) noexcept { return at(rows.goal, j) - at(rows.q, j); };
  const auto velocity = [&](int j) noexcept { return at(rows.v, j); };
  // G = I + J Jᵀ for the column J: G⁻¹ x = x − J (J · x) / (1 + |J|²).
  Lanes squared = all(1.0), along = {};
  Lanes room = all(__builtin_inf()), zero = {};  // how far positions are within limits; x − x of every number
  for (int j = 0; j < num; ++j) {
    const Lanes q = at(rows.q, j), goal = at(rows.goal, j), v = at(rows.v, j), J = at(rows.gradient, j);
    room = smaller(room, smaller(q - model.lower[j], model.upper[j] - q));
    room = smaller(room, smaller(goal - model.lower[j], model.upper[j] - goal));
    zero += (q - q) + (goal - goal) + (v - v);
    Lanes pull = gained(model.stiffness, model.stiffness_is_diagonal, num, j, way);
    if (model.damps_by_metric) {
      pull -= gained(model.damping, model.damping_is_diagonal, num, j, velocity);
    }
    squared += J * J;
    along += J * pull;
    store(rows.harmonic + j * most_lanes, pull);
  }
  const Lanes share = along / squared, fall = at(rows.curvature, 0) / squared;
  const Lanes harmonic_weight = at(rows.harmonic_weight, 0), fall_weight = at(rows.fall_weight, 0);
  for (int j = 0; j < num; ++j) {
    const Lanes J = at(rows.gradient, j);
    Lanes harmonic = at(rows.harmonic, j) - share * J;
    if (!model.damps_by_metric) {
      harmonic -= gained(model.damping, model.damping_is_diagonal, num, j, velocity);
    }
    const Lanes acceleration = harmonic_weight * harmonic - fall_weight * (fall * J);
    zero += acceleration - acceleration;
    store(rows.harmonic + j * most_lanes, harmonic);
    store(rows.acceleration + j * most_lanes, acceleration);
  }
  return ~below(room, Lanes{}) & below(magnitude(zero), all(1.0));
}

unsigned take_steps(const StepModel& model, const StepRows& rows) noexcept {
  unsigned regular = 0;
  for (int first = 0; first < most_lanes; first += width) {
    const StepRows some{rows.q + first,         rows.v + first,         rows.goal + first,
                        rows.gradient + first,  rows.curvature + first, rows.harmonic_weight + first,
                        rows.fall_weight + first, rows.harmonic + first,  rows.acceleration + first};
    regular |= (take_some(model, some) & ((1u << width) - 1u)) << first;
  }
  return regular;
}

}  // namespace
}  // namespace sidestep::kernels
