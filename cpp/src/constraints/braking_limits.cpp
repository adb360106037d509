#include "sidestep/constraints/braking_limits.hpp"

#include <algorithm>
#include <cmath>

#include "../math/cholesky.hpp"
#include "../math/settings.hpp"

namespace sidestep {
namespace {

// Longest stop by torque, in times of the stop by the acceleration limits: with longer ones lines would be so flat that the
// arm stands still.
constexpr double longest_stop = 10.0;
constexpr double linear = 1e4;                // Weight of the direction against the size of accelerations.
constexpr double largest_acceleration = 1e3;  // Acceleration bound of joints without a limit [/s²].

}  // namespace

BrakingLimits::BrakingLimits(int num_coordinates, int max_rows)
    : momentum_(Eigen::VectorXd::Zero(num_coordinates)),
      responses_(RowBlock::Matrix::Zero(num_coordinates, max_rows)),
      effort_lower_(momentum_),
      effort_upper_(momentum_),
      reach_data_(num_coordinates, num_coordinates),
      reach_(num_coordinates, num_coordinates) {}

void BrakingLimits::update(int first, int size, const std::vector<int>& of, const Eigen::MatrixXd& gradients,
                           const JointLimits& limits, const BrakingTorque& torque) noexcept {
  reach_data_.A = torque.mass;
  effort_lower_ = -limits.effort - torque.bias;
  effort_upper_ = limits.effort - torque.bias;
  find_responses(first, size, of, gradients, torque.mass_cholesky);
}

void BrakingLimits::find_responses(int first, int size, const std::vector<int>& of, const Eigen::MatrixXd& gradients,
                                   const Eigen::MatrixXd& L) noexcept {
  const Eigen::Index nv = responses_.rows();
  for (int row = first; row < size; ++row) {
    responses_.col(row) = gradients.col(of[static_cast<std::size_t>(row)]);
  }
  const auto divide = [&](Eigen::Index i) {
    for (int row = first; row < size; ++row) {
      responses_(i, row) /= L(i, i);
    }
  };
  const auto subtract = [&](Eigen::Index i, double factor, Eigen::Index k) {
    for (int row = first; row < size; ++row) {
      responses_(i, row) -= factor * responses_(k, row);
    }
  };
  for (Eigen::Index i = 0; i < nv; ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      subtract(i, L(i, k), k);
    }
    divide(i);
  }
  for (Eigen::Index i = nv - 1; i >= 0; --i) {
    for (Eigen::Index k = i + 1; k < nv; ++k) {
      subtract(i, L(k, i), k);
    }
    divide(i);
  }
}

double BrakingLimits::hardest_by_torque(int row, const JointLimits& limits, const BrakingTorque& torque) const noexcept {
  double hardest = 0.0;
  for (Eigen::Index j = 0; j < responses_.rows(); ++j) {
    const double response = responses_(j, row);
    if (response != 0.0) {
      hardest += std::abs(response) * limits.effort[j] - response * torque.bias[j];
    }
  }
  return hardest;
}

double BrakingLimits::largest_by_both(ConstVectorRef direction, const Eigen::VectorXd& least, const Eigen::VectorXd& most,
                                      const Eigen::VectorXd& row_lower, const Eigen::VectorXd& row_upper,
                                      double otherwise) noexcept {
  // w n·a − |a|²/2 with so large a w that the second term does not count.
  double size = 0.0;
  for (Eigen::Index j = 0; j < most.size(); ++j) {
    size = std::max(size, std::min(std::max(std::abs(least[j]), std::abs(most[j])), largest_acceleration));
  }
  const double length = direction.norm();
  reach_data_.g = -linear * size / length * direction;
  reach_data_.lower = least;
  reach_data_.upper = most;
  reach_data_.row_lower = row_lower;
  reach_data_.row_upper = row_upper;
  if (reach_.solve(reach_data_) != QuadraticProgramStatus::solved) {
    return otherwise;
  }
  return direction.dot(reach_.solution());
}

double BrakingLimits::stop_time(const Eigen::VectorXd& v, const JointLimits& limits, const BrakingTorque* torque) noexcept {
  const double by_limits = v.cwiseAbs().cwiseQuotient(limits.acceleration).maxCoeff();
  if (torque == nullptr) {
    return by_limits;
  }
  // |bias − M v/τ| <= effort
  double by_torque = 0.0;
  momentum_ = v;
  multiply_in_place(torque->mass_cholesky, momentum_);
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const double momentum = momentum_[j];
    const double left = limits.effort[j] + (momentum > 0.0 ? torque->bias[j] : -torque->bias[j]);
    if (momentum != 0.0) {
      by_torque = std::max(by_torque, left > 0.0 ? std::abs(momentum) / left : infinity);
    }
  }
  if (by_limits == 0.0) {  // none, or at rest
    return std::isfinite(by_torque) ? by_torque : 0.0;
  }
  return std::clamp(by_torque, by_limits, longest_stop * by_limits);
}

}  // namespace sidestep
