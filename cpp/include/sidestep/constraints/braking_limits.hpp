#pragma once

#include <Eigen/Core>

#include "sidestep/constraints/constraint.hpp"
#include "sidestep/math/quadratic_program.hpp"

namespace sidestep {

/// Braking ability of the arm within its acceleration and torque limits. Memory is allocated at construction.
class BrakingLimits {
 public:
  BrakingLimits(int num_coordinates, int max_rows);

  /// τ [s]: duration of a stop along the path, −v/τ, within the limits; see clearance_demand.hpp.
  double stop_time(const Eigen::VectorXd& v, const JointLimits& limits, const BrakingTorque* torque) noexcept;
  /// Takes the dynamics, and the gradients (nv) of `size` rows from `first` on: column `of[row]` each.
  void update(int first, int size, const std::vector<int>& of, const Eigen::MatrixXd& gradients, const JointLimits& limits,
              const BrakingTorque& torque) noexcept;
  /// (M⁻¹∇h)·(torque − bias) at the effort limits, of a row that `update` took.
  double hardest_by_torque(int row, const JointLimits& limits, const BrakingTorque& torque) const noexcept;
  /// max direction·a with the acceleration in one box and M a in another, by default that of the effort limits; `otherwise` if
  /// there is no such a.
  double largest_by_both(ConstVectorRef direction, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                         const Eigen::VectorXd& row_lower, const Eigen::VectorXd& row_upper, double otherwise) noexcept;
  double largest_by_both(ConstVectorRef direction, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                         double otherwise) noexcept {
    return largest_by_both(direction, lower, upper, effort_lower_, effort_upper_, otherwise);
  }

 private:
  /// Writes M⁻¹ ∇h, side by side: divisions of one wait for each other.
  void find_responses(int first, int size, const std::vector<int>& of, const Eigen::MatrixXd& gradients,
                      const Eigen::MatrixXd& mass_cholesky) noexcept;

  Eigen::VectorXd momentum_;                     // M v (nv).
  RowBlock::Matrix responses_;                   // M⁻¹ ∇h of the chosen rows (nv, max).
  Eigen::VectorXd effort_lower_, effort_upper_;  // Bounds of M q̈ by effort (nv).
  QuadraticProgramData reach_data_;
  QuadraticProgram reach_;  // Program of the largest acceleration along a direction, within acceleration and torque limits.
};

}  // namespace sidestep
