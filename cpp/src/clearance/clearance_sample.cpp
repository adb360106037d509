#include "sidestep/clearance/clearance_sample.hpp"

namespace sidestep {
namespace {

/// Returns the gradient, which is still zero.
double* write_numbers(const ClearanceSample& sample, Eigen::Index k, ClearanceStateView& out) noexcept {
  out.values[k] = sample.value;
  out.rates[k] = sample.rate;
  out.curvatures[k] = sample.curvature;
  out.gradients.col(k).setZero();
  return out.gradients.col(k).data();
}

}  // namespace

void write(const ClearanceSample& sample, const KinematicState& state, int first_joint, int second_joint, Eigen::Index k,
           ClearanceStateView& out) noexcept {
  write_numbers(sample, k, out);
  accumulate_generalised_force(state, first_joint, sample.gradient.first, out.gradients.col(k));
  accumulate_generalised_force(state, second_joint, sample.gradient.second, out.gradients.col(k));
}

void write(const ClearanceSample& sample, const ClearanceSample& approach, const KinematicState& state, int joint,
           Eigen::Index k, ClearanceView& out) noexcept {
  accumulate_generalised_forces<2>(state, joint, {sample.gradient.first, approach.gradient.first},
                                   {write_numbers(sample, k, out), write_numbers(approach, k, out.approach)});
}

}  // namespace sidestep
