#include "sidestep/attractor/graph_metric.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "../math/kernels/in_use.hpp"
#include "kernels/gram_kernel.hpp"

namespace sidestep {
namespace {

kernels::AddGram add_gram() noexcept { return SIDESTEP_KERNEL_IN_USE(kernels::add_gram); }

}  // namespace

GraphMetric::GraphMetric(int nv, int m)
    : used_(static_cast<std::size_t>(m), 0),
      jacobian_transposed_(Eigen::MatrixXd::Zero(nv, m + (nv > 0 ? (kernels::gram_room + nv - 1) / nv : 0))),
      factor_(Eigen::MatrixXd::Zero(nv, nv)),
      along_(Eigen::VectorXd::Zero(m)) {}

void GraphMetric::update(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed) noexcept {
  num_used_ = 0;
  with_size(jacobian_transposed.rows(), [&](auto nv) {
    for (Eigen::Index a = 0; a < jacobian_transposed.cols(); ++a) {
      const auto column = sized(jacobian_transposed.data() + a * jacobian_transposed.outerStride(), nv);
      if (column.cwiseAbs().sum() != 0.0) {  // of most columns every entry is zero
        sized(jacobian_transposed_.col(num_used_), nv) = column;
        used_[static_cast<std::size_t>(num_used_++)] = a;
      }
    }
    if (num_used_ == 1) {
      factor_(0, 0) = 1.0 + sized(jacobian_transposed_, nv).squaredNorm();
    }
  });
  const auto J_T = columns();
  if (num_used_ > 1) {
    const Eigen::Index size = std::min(num_used_, J_T.rows());
    Eigen::Ref<Eigen::MatrixXd> matrix = factor_.topLeftCorner(size, size);
    matrix.setIdentity();
    if (is_small()) {
      matrix += J_T.transpose().lazyProduct(J_T);
    } else {
      add_gram()(J_T.data(), static_cast<int>(num_used_), static_cast<int>(size), matrix.data(),
                 static_cast<int>(matrix.outerStride()));
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> in_place(matrix);
  }
}

Eigen::MatrixXd GraphMetric::matrix() const {
  const Eigen::Index nv = jacobian_transposed_.rows();
  return Eigen::MatrixXd::Identity(nv, nv) + columns() * columns().transpose();
}

void GraphMetric::solve_factored(Eigen::Ref<Eigen::VectorXd> x) const noexcept {
  const auto L = factor_.topLeftCorner(x.size(), x.size());
  L.triangularView<Eigen::Lower>().solveInPlace(x);
  L.transpose().triangularView<Eigen::Upper>().solveInPlace(x);
}

void GraphMetric::solve_in_place(Eigen::Ref<Eigen::VectorXd> x) noexcept {
  if (num_used_ == 0) {
    return;
  }
  if (!is_small()) {
    solve_factored(x);
    return;
  }
  if (num_used_ == 1) {
    with_size(x.size(), [&](auto nv) {
      const auto J_T = sized(jacobian_transposed_, nv);
      auto result = sized(x, nv);
      result -= J_T.dot(result) / factor_(0, 0) * J_T;
    });
    return;
  }
  auto along = along_.head(num_used_);
  along = columns().transpose().lazyProduct(x);
  solve_factored(along);
  x -= columns().lazyProduct(along);
}

void GraphMetric::solve_pullback(ConstVectorRef c, Eigen::Ref<Eigen::VectorXd> x) noexcept {
  if (num_used_ == 1) {
    with_size(x.size(), [&](auto nv) { sized(x, nv) = c[used_[0]] / factor_(0, 0) * sized(jacobian_transposed_, nv); });
    return;
  }
  auto along = along_.head(num_used_);
  for (Eigen::Index a = 0; a < num_used_; ++a) {
    along[a] = c[used_[static_cast<std::size_t>(a)]];
  }
  if (num_used_ > 0 && is_small()) {
    solve_factored(along);
  }
  x = columns().lazyProduct(along);
  if (!is_small()) {
    solve_factored(x);
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
  const Eigen::MatrixXd inverse = (Eigen::MatrixXd::Identity(nv, nv) + jacobian.transpose() * jacobian).inverse();
  std::vector<Eigen::MatrixXd> derivative(static_cast<std::size_t>(nv), Eigen::MatrixXd::Zero(nv, nv));  // ∂_k G
  for (Eigen::Index k = 0; k < nv; ++k) {
    for (std::size_t a = 0; a < hessians.size(); ++a) {
      const Eigen::RowVectorXd J = jacobian.row(static_cast<Eigen::Index>(a));
      const Eigen::RowVectorXd H = hessians[a].row(k);
      derivative[static_cast<std::size_t>(k)] += H.transpose() * J + J.transpose() * H;
    }
  }
  const auto d = [&](Eigen::Index k, Eigen::Index i, Eigen::Index j) { return derivative[static_cast<std::size_t>(k)](i, j); };
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
