#include "sidestep/embedding/clearance_sample.hpp"

namespace sidestep {

void write(const ClearanceSample& sample, const KinematicState& state, int first_joint, int second_joint,
           Eigen::Index k, ClearanceStateView& out) noexcept {
  out.values[k] = sample.value;
  out.rates[k] = sample.rate;
  out.curvatures[k] = sample.curvature;
  out.gradients.col(k).setZero();
  accumulate_generalised_force(state, first_joint, sample.gradient.first, out.gradients.col(k));
  accumulate_generalised_force(state, second_joint, sample.gradient.second, out.gradients.col(k));
}

}  // namespace sidestep
