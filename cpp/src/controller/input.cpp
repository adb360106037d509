#include "input.hpp"

#include <cmath>

namespace sidestep {
namespace {

constexpr double joint_rest = 5e-4;     // speed of a joint that counts as rest [rad/s]
constexpr double prismatic_rest = 0.1;  // the same of prismatic joints, as a share of that [m/rad]
constexpr double cross_share = 0.01;    // share of the fastest joint that others may be off [-]

}  // namespace

double UsableLimits::scale(Eigen::VectorXd& v, Reduction& reduction) const noexcept {
  double share = 1.0;
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    if (std::abs(v[j]) * share > velocity[j]) {
      share = velocity[j] / std::abs(v[j]);
      reduction.by = Reduction::By::speed;
      reduction.joint = j;
    }
  }
  v *= share;
  return share;
}

double joint_tolerance(const Eigen::VectorXd& asked, Eigen::Index j, bool slides) noexcept {
  return InputTolerance::share * std::abs(asked[j]) + cross_share * asked.cwiseAbs().maxCoeff() +
         joint_rest * (slides ? prismatic_rest : 1.0);
}

}  // namespace sidestep
