#pragma once

#include <Eigen/Core>
#include <limits>

namespace sidestep {

/// Clearances with their derivatives, one entry per coordinate.
struct ClearanceStateView {
  Eigen::Map<Eigen::VectorXd> values;      ///< Clearances h (m) [m], signed.
  Eigen::Map<Eigen::VectorXd> rates;       ///< Rates dh/dt (m) [m/s], obstacle velocities included.
  Eigen::Map<Eigen::VectorXd> curvatures;  ///< Curvatures d²h/dt² at q̈ = 0 (m) [m/s²].
  Eigen::Map<Eigen::MatrixXd> gradients;   ///< Gradients ∂h/∂q as columns (nv × m) [m/rad].
};

/// Output of a barrier for its clearances.
struct ClearanceView : ClearanceStateView {
  Eigen::Map<Eigen::VectorXi> nearest;  ///< Nearest point (m); beyond the reach the one that approaches; -1: neither.
  Eigen::Map<Eigen::VectorXd> margins;  ///< Largest margin (m) that ClearanceConstraints keep [m].
  ClearanceStateView approach;          ///< State of the critical sample, see stopping_clearance.hpp.
  Eigen::Map<Eigen::VectorXd> least;    ///< Smallest clearance (m) of those that h is the mean of [m]; +inf: beyond the reach.
};

/// Memory of such views.
struct ClearanceState {
  ClearanceState(int nv, int num)
      : values(Eigen::VectorXd::Constant(num, std::numeric_limits<double>::infinity())),
        rates(Eigen::VectorXd::Zero(num)),
        curvatures(Eigen::VectorXd::Zero(num)),
        gradients(Eigen::MatrixXd::Zero(nv, num)) {}

  ClearanceStateView state_view(Eigen::Index start, Eigen::Index num) noexcept {
    return {{values.data() + start, num},
            {rates.data() + start, num},
            {curvatures.data() + start, num},
            {gradients.data() + start * gradients.rows(), gradients.rows(), num}};
  }

  Eigen::VectorXd values, rates, curvatures;
  Eigen::MatrixXd gradients;
};

/// Clearances, +inf beyond the reach, and their critical samples. Where `nearest` is -1 the other entries have no meaning.
struct Clearances : ClearanceState {
  Clearances(int nv, int num)
      : ClearanceState(nv, num),
        nearest(Eigen::VectorXi::Constant(num, -1)),
        margins(Eigen::VectorXd::Constant(num, std::numeric_limits<double>::infinity())),
        approach(nv, num),
        least(values) {}

  /// Forgets everything: nothing is within reach.
  void clear() noexcept {
    values.setConstant(std::numeric_limits<double>::infinity());
    nearest.setConstant(-1);
    least.setConstant(std::numeric_limits<double>::infinity());
  }
  /// Makes the nearest sample the critical and the smallest one.
  void mind_nearest() {
    approach = *this;
    least = values;
  }

  ClearanceView view(Eigen::Index start, Eigen::Index num) noexcept {
    return {state_view(start, num),
            {nearest.data() + start, num},
            {margins.data() + start, num},
            approach.state_view(start, num),
            {least.data() + start, num}};
  }

  Eigen::VectorXi nearest;
  Eigen::VectorXd margins;
  ClearanceState approach;
  /// Smallest clearances (m), never above the smooth `values`: below zero in contact. +inf for a coordinate that is no clearance.
  Eigen::VectorXd least;
};

}  // namespace sidestep
