#include "sidestep/embedding/ellipsoid_gap.hpp"

#include "kernels/gap_kernel.hpp"
#include "sidestep/embedding/instruction_set.hpp"

namespace sidestep {
namespace {

kernels::FindGaps find_gaps() noexcept {
#if defined(SIDESTEP_X86_KERNELS)
  switch (instruction_set()) {
    case InstructionSet::avx512: return kernels::find_gaps_avx512;
    case InstructionSet::avx2: return kernels::find_gaps_avx2;
    case InstructionSet::baseline: break;
  }
#endif
  return kernels::find_gaps_baseline;
}

constexpr int capacity = EllipsoidPairs::capacity;

void write(const Eigen::Matrix3d& S, double (&columns)[6][capacity], int k) noexcept {
  int entry = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      columns[entry++][k] = S(i, j);
    }
  }
}

}  // namespace

EllipsoidGaps::EllipsoidGaps(const KinematicState::Link& a, const KinematicState::Link& b) noexcept {
  RelativeMotion& motion = pairs_.motion;
  const Eigen::Matrix3d R_AW = a.R_WL.transpose();
  Eigen::Matrix3d::Map(motion.rotation) = R_AW * b.R_WL;
  Eigen::Vector3d::Map(motion.position) = R_AW * (b.p_WL - a.p_WL);
  // Seen from a: V = V_b − V_a, and V' less what a turns it by, A_b − A_a − V_a × V.
  const Eigen::Vector3d angular = b.velocity.angular - a.velocity.angular;
  const Eigen::Vector3d linear = b.velocity.linear - a.velocity.linear;
  const Eigen::Vector3d bias_angular = b.bias.angular - a.bias.angular - a.velocity.angular.cross(angular);
  const Eigen::Vector3d bias_linear =
      b.bias.linear - a.bias.linear - a.velocity.angular.cross(linear) - a.velocity.linear.cross(angular);
  Eigen::Vector3d::Map(motion.angular) = R_AW * angular;
  Eigen::Vector3d::Map(motion.linear) = R_AW * (linear + angular.cross(a.p_WL));
  Eigen::Vector3d::Map(motion.bias_angular) = R_AW * bias_angular;
  Eigen::Vector3d::Map(motion.bias_linear) = R_AW * (bias_linear + bias_angular.cross(a.p_WL));
}

void EllipsoidGaps::add(const Eigen::Vector3d& centre_a, const Eigen::Matrix3d& S_a, const Eigen::Vector3d& centre_b,
                        const Eigen::Matrix3d& S_b) noexcept {
  const int k = pairs_.size++;
  for (int i = 0; i < 3; ++i) {
    pairs_.centre_a[i][k] = centre_a[i];
    pairs_.centre_b[i][k] = centre_b[i];
  }
  write(S_a, pairs_.shape_a, k);
  write(S_b, pairs_.shape_b, k);
}

void EllipsoidGaps::solve() noexcept { find_gaps()(pairs_); }

EllipsoidGap EllipsoidGaps::operator[](int k) const noexcept {
  const auto column = [k](const double (&columns)[3][capacity]) {
    return Eigen::Vector3d(columns[0][k], columns[1][k], columns[2][k]);
  };
  return {pairs_.value[k], pairs_.rate[k], pairs_.curvature[k], column(pairs_.normal), column(pairs_.contact)};
}

EllipsoidGap ellipsoid_gap(const Eigen::Vector3d& d, const Eigen::Matrix3d& S_a, const Eigen::Matrix3d& S_b) noexcept {
  EllipsoidGaps gaps;
  gaps.add(Eigen::Vector3d::Zero(), S_a, d, S_b);
  gaps.solve();
  return gaps[0];
}

}  // namespace sidestep
