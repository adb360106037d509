#pragma once

#include <Eigen/Core>
#include <limits>

namespace sidestep {

/// Where an embedding that is a barrier of clearances h writes them, one entry per coordinate.
struct ClearanceView {
  Eigen::Ref<Eigen::VectorXd> values;      ///< h (m) [m], signed; +inf beyond the reach
  Eigen::Ref<Eigen::VectorXd> rates;       ///< dh/dt (m) [m/s], obstacle velocities included
  Eigen::Ref<Eigen::VectorXd> curvatures;  ///< d²h/dt² at q̈ = 0 (m) [m/s²]
  Eigen::Ref<Eigen::VectorXd> mixing;      ///< what of it is the mean going over to other points (m), see BoltzmannMean
  Eigen::Ref<Eigen::MatrixXd> gradients;   ///< ∂h/∂q as columns (nv × m) [m/rad]
  Eigen::Ref<Eigen::VectorXi> nearest;     ///< (m) index of the nearest obstacle point, -1 where there is none
};

/// The room such views look into. Where the clearance is +inf the other entries have no meaning.
struct Clearances {
  Clearances(int nv, int num)
      : values(Eigen::VectorXd::Constant(num, std::numeric_limits<double>::infinity())),
        rates(Eigen::VectorXd::Zero(num)),
        curvatures(Eigen::VectorXd::Zero(num)),
        mixing(Eigen::VectorXd::Zero(num)),
        gradients(Eigen::MatrixXd::Zero(nv, num)),
        nearest(Eigen::VectorXi::Constant(num, -1)) {}

  /// Forgets everything: nothing is within reach.
  void clear() noexcept {
    values.setConstant(std::numeric_limits<double>::infinity());
    nearest.setConstant(-1);
  }
  ClearanceView view(Eigen::Index start, Eigen::Index num) noexcept {
    return {values.segment(start, num), rates.segment(start, num), curvatures.segment(start, num),
            mixing.segment(start, num), gradients.middleCols(start, num), nearest.segment(start, num)};
  }

  Eigen::VectorXd values, rates, curvatures, mixing;
  Eigen::MatrixXd gradients;
  Eigen::VectorXi nearest;
};

}  // namespace sidestep
