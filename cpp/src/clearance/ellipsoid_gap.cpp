#include "sidestep/clearance/ellipsoid_gap.hpp"

#include "../math/kernels/in_use.hpp"
#include "kernels/gap_kernel.hpp"

namespace sidestep {
namespace {

kernels::GapKernel gap_kernel() noexcept { return SIDESTEP_KERNEL_IN_USE(kernels::gap_kernel)(); }

template <int capacity>
void write(const Eigen::Matrix3d& S, double (&columns)[6][capacity], int k) noexcept {
  int entry = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      columns[entry++][k] = S(i, j);
    }
  }
}

}  // namespace

EllipsoidGaps::EllipsoidGaps(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB, const SpatialMotion& velocity,
                             const SpatialMotion& bias) noexcept {
  RelativeMotion& motion = pairs_.motion;
  Eigen::Matrix3d::Map(motion.rotation) = R_AB;
  Eigen::Vector3d::Map(motion.position) = p_AB;
  Eigen::Vector3d::Map(motion.angular) = velocity.angular;
  Eigen::Vector3d::Map(motion.linear) = velocity.linear;
  Eigen::Vector3d::Map(motion.bias_angular) = bias.angular;
  Eigen::Vector3d::Map(motion.bias_linear) = bias.linear;
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

void EllipsoidGaps::solve() noexcept { gap_kernel().find(pairs_); }

EllipsoidGap EllipsoidGaps::operator[](int k) const noexcept {
  const auto column = [k](const double (&columns)[3][EllipsoidPairs::capacity]) {
    return Eigen::Vector3d(columns[0][k], columns[1][k], columns[2][k]);
  };
  return {pairs_.value[k], pairs_.rate[k], pairs_.curvature[k], column(pairs_.normal), column(pairs_.contact)};
}

void EllipsoidRow::add(const Eigen::Vector3d& centre, const Eigen::Matrix3d& S) noexcept {
  const int k = columns_.size++;
  for (int i = 0; i < 3; ++i) {
    columns_.centre[i][k] = centre[i];
  }
  write(S, columns_.shape, k);
}

void EllipsoidRow::bound(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& centre_b, const Eigen::Matrix3d& S_b,
                         std::array<double, capacity>& bounds) const noexcept {
  double shape[6][1];
  write(S_b, shape, 0);
  gap_kernel().bound(columns_, R_AB.data(), centre_b.data(), shape[0], bounds.data());
}

EllipsoidGap ellipsoid_gap(const Eigen::Vector3d& d, const Eigen::Matrix3d& S_a, const Eigen::Matrix3d& S_b) noexcept {
  EllipsoidGaps gaps;
  gaps.add(Eigen::Vector3d::Zero(), S_a, d, S_b);
  gaps.solve();
  return gaps[0];
}

}  // namespace sidestep
