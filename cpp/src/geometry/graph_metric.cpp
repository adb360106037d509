#include "sidestep/geometry/graph_metric.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace sidestep {

GraphMetric::GraphMetric(int nv, int m)
    : matrix_(Eigen::MatrixXd::Identity(nv, nv)),
      jacobian_transposed_(Eigen::MatrixXd::Zero(nv, m)),
      small_matrix_(Eigen::MatrixXd::Identity(std::min(m, nv), std::min(m, nv))),
      factor_(small_matrix_),
      along_(Eigen::VectorXd::Zero(m)) {}

void GraphMetric::update(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed) noexcept {
  jacobian_transposed_ = jacobian_transposed;
  const auto& J_T = jacobian_transposed_;
  matrix_.setIdentity();
  matrix_ += J_T.lazyProduct(J_T.transpose());
  if (J_T.cols() > J_T.rows()) {
    factor_.compute(matrix_);
  } else {
    small_matrix_.setIdentity();
    small_matrix_ += J_T.transpose().lazyProduct(J_T);
    if (J_T.cols() > 1) {
      factor_.compute(small_matrix_);
    }
  }
}

void GraphMetric::solve_small(Eigen::Ref<Eigen::VectorXd> c) const noexcept {
  if (c.size() == 1) {
    c[0] /= small_matrix_(0, 0);
  } else {
    factor_.solveInPlace(c);
  }
}

void GraphMetric::solve_in_place(Eigen::Ref<Eigen::VectorXd> x) noexcept {
  const auto& J_T = jacobian_transposed_;
  if (J_T.cols() > J_T.rows()) {
    factor_.solveInPlace(x);
  } else if (J_T.cols() > 0) {
    along_ = J_T.transpose().lazyProduct(x);
    solve_small(along_);
    x -= J_T.lazyProduct(along_);
  }
}

void GraphMetric::solve_pullback(const Eigen::Ref<const Eigen::VectorXd>& c, Eigen::Ref<Eigen::VectorXd> x) noexcept {
  const auto& J_T = jacobian_transposed_;
  if (J_T.cols() > J_T.rows()) {
    x = J_T.lazyProduct(c);
    factor_.solveInPlace(x);
  } else if (J_T.cols() > 0) {
    along_ = c;
    solve_small(along_);
    x = J_T.lazyProduct(along_);
  } else {
    x.setZero();
  }
}

Eigen::VectorXd geodesic_acceleration(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& curvatures) {
  GraphMetric metric(static_cast<int>(jacobian.cols()), static_cast<int>(jacobian.rows()));
  metric.update(jacobian.transpose());
  Eigen::VectorXd acceleration(jacobian.cols());
  metric.solve_pullback(curvatures, acceleration);
  return -acceleration;
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
