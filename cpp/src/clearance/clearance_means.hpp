#pragma once

#include <Eigen/Core>

#include "kernels/clearance_kernel.hpp"
#include "sidestep/clearance/boltzmann_mean.hpp"
#include "sidestep/clearance/clearance_sample.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// The means of a query's points, with wrenches about the world origin.
class ClearanceMeans {
 public:
  ClearanceMeans(const kernels::Query& query, const Eigen::Vector3d& centre, double inverse_T) noexcept
      : query_(query), centre_(centre), inverse_T_(inverse_T) {
    for (int i = 0; i < kernels::sums; ++i) {
      sums_[i] = Eigen::Map<const Eigen::Matrix<double, kernels::most_lanes, 1>>(query.lane_sums[i]).sum();
    }
    const double* A = query.squared_axes;
    const Eigen::Array3d per_twist(A[1] - A[2], A[2] - A[0], A[0] - A[1]);
    for (const int first : {of_weights, of_heights, kernels::approach + 4}) {
      Eigen::Array3d::Map(sums_ + first + 3) *= per_twist;
    }
    sums_[2] -= of_bias(of_weights);
    sums_[6] -= of_bias(of_heights);
    sums_[kernels::approach + 3] -= of_bias(kernels::approach + 4);
  }

  /// With w' = −w h'/T.
  ClearanceSample nearest() const noexcept {
    const double *s = sums_, k = inverse_T_;
    ClearanceSample mean = BoltzmannMean::Sums{s[0], -k * s[1],       k * (k * s[3] - s[2]),
                                               s[4], s[1] - k * s[5], s[2] - k * (2.0 * s[3] + s[6] - k * s[7])}
                               .mean();
    mean.gradient = wrench(((1.0 + k * mean.value) * gradient(of_weights) - k * gradient(of_heights)) * (1.0 / s[0]));
    mean.value += query_.reference;
    return mean;
  }

  ClearanceSample approach() const noexcept {
    const double* s = sums_ + kernels::approach;
    const double share = 1.0 / s[0];
    return {s[1] * share, s[2] * share, s[3] * share, wrench(gradient(kernels::approach + 4) * share)};
  }

 private:
  // Places of force and moment in the sums: with the weights, and with weighted heights.
  static constexpr int of_weights = 8, of_heights = 14;

  Vector6d gradient(int first) const noexcept { return Vector6d::Map(sums_ + first); }
  /// What the bias of the link makes of sums of h'', from those of the gradient.
  double of_bias(int first) const noexcept {
    return Eigen::Vector3d::Map(query_.bias_linear).dot(gradient(first).head<3>()) +
           Eigen::Vector3d::Map(query_.bias_angular).dot(gradient(first).tail<3>());
  }
  WrenchPair wrench(const Vector6d& gradient) const noexcept {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(query_.axes);
    const Eigen::Vector3d force = -(axes.transpose() * gradient.head<3>());
    return {{centre_.cross(force) - axes.transpose() * gradient.tail<3>(), force}, {}};
  }

  const kernels::Query& query_;
  Eigen::Vector3d centre_;
  double inverse_T_;
  double sums_[kernels::sums];
};

}  // namespace sidestep
