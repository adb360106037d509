#pragma once

#include "../../kinematics/kernels/most_lanes.hpp"

// The equations of a system with one embedding coordinate, once per instruction set. Plain arrays only, see
// kinematics_kernel.hpp.
namespace sidestep::kernels {

/// What of a system does not change.
struct StepModel {
  int num;                            // coordinates
  const double *stiffness, *damping;  // of each coordinate, or nv × nv, symmetric
  bool stiffness_is_diagonal, damping_is_diagonal;
  bool damps_by_metric;               // damping is under G⁻¹ as well
  const double *lower, *upper;        // limits of positions
};

/// Rows of `most_lanes` numbers, one of each state side by side; those of arrays are a row for each coordinate.
struct StepRows {
  const double *q, *v, *goal;
  const double *gradient, *curvature;          // of ψ
  const double *harmonic_weight, *fall_weight;  // of h and of g in the acceleration
  double* harmonic;                            // −G⁻¹ K (q − q*) − D v, or with D v under G⁻¹ too
  double* acceleration;
};

/// Writes the accelerations. Bit k is set where q and goal of state k are within limits, and everything is finite.
using TakeSteps = unsigned (*)(const StepModel& model, const StepRows& rows) noexcept;

unsigned take_steps_baseline(const StepModel& model, const StepRows& rows) noexcept;
unsigned take_steps_avx2(const StepModel& model, const StepRows& rows) noexcept;
unsigned take_steps_avx512(const StepModel& model, const StepRows& rows) noexcept;

}  // namespace sidestep::kernels
