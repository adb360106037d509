#include "sidestep/geometry/graph_metric.hpp"

#include <Eigen/LU>

namespace sidestep {

GraphMetric::GraphMetric(int nv)
    : matrix_(Eigen::MatrixXd::Identity(nv, nv)), factor_(nv), gradient_(Eigen::VectorXd::Zero(nv)) {}

void GraphMetric::update(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed) noexcept {
  rank_one_ = jacobian_transposed.cols() <= 1;
  matrix_.setIdentity();
  if (!rank_one_) {
    for (Eigen::Index a = 0; a < jacobian_transposed.cols(); ++a) {
      const auto gradient = jacobian_transposed.col(a);
      if (!gradient.isZero(0.0)) {  // most barriers are out of reach most of the time
        matrix_ += gradient.lazyProduct(gradient.transpose());
      }
    }
    factor_.compute(matrix_);
  } else if (jacobian_transposed.cols() == 1) {
    gradient_ = jacobian_transposed.col(0);
    inverse_scale_ = 1.0 / (1.0 + gradient_.squaredNorm());
    matrix_ += gradient_.lazyProduct(gradient_.transpose());
  }
}

void GraphMetric::solve_in_place(Eigen::Ref<Eigen::VectorXd> x) const noexcept {
  if (rank_one_) {
    x -= (gradient_.dot(x) * inverse_scale_) * gradient_;
  } else {
    factor_.solveInPlace(x);
  }
}

Eigen::VectorXd geodesic_acceleration(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& curvatures) {
  GraphMetric metric(static_cast<int>(jacobian.cols()));
  metric.update(jacobian.transpose());
  Eigen::VectorXd acceleration = -(jacobian.transpose() * curvatures);
  metric.solve_in_place(acceleration);
  return acceleration;
}

std::vector<Eigen::MatrixXd> christoffel_symbols(const Eigen::MatrixXd& jacobian,
                                                 const std::vector<Eigen::MatrixXd>& hessians) {
  const Eigen::Index nv = jacobian.cols();
  const Eigen::MatrixXd inverse =
      (Eigen::MatrixXd::Identity(nv, nv) + jacobian.transpose() * jacobian).inverse();
  std::vector<Eigen::MatrixXd> derivative(static_cast<std::size_t>(nv), Eigen::MatrixXd::Zero(nv, nv));  // ∂_k G
  for (Eigen::Index k = 0; k < nv; ++k) {
    for (std::size_t a = 0; a < hessians.size(); ++a) {
      const Eigen::RowVectorXd J = jacobian.row(static_cast<Eigen::Index>(a));
      const Eigen::RowVectorXd H = hessians[a].row(k);
      derivative[static_cast<std::size_t>(k)] += H.transpose() * J + J.transpose() * H;
    }
  }
  const auto d = [&](Eigen::Index k, Eigen::Index i, Eigen::Index j) {
    return derivative[static_cast<std::size_t>(k)](i, j);
  };
  std::vector<Eigen::MatrixXd> symbols(static_cast<std::size_t>(nv), Eigen::MatrixXd::Zero(nv, nv));
  for (Eigen::Index k = 0; k < nv; ++k) {
    for (Eigen::Index i = 0; i < nv; ++i) {
      for (Eigen::Index j = 0; j < nv; ++j) {
        double sum = 0.0;
        for (Eigen::Index l = 0; l < nv; ++l) {
          sum += inverse(k, l) * (d(i, l, j) + d(j, l, i) - d(l, i, j));
        }
        symbols[static_cast<std::size_t>(k)](i, j) = 0.5 * sum;
      }
    }
  }
  return symbols;
}

}  // namespace sidestep
