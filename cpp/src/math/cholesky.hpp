#pragma once

#include <Eigen/Core>
#include <cmath>

#include "sidestep/math/vectors.hpp"

namespace sidestep {

/// Writes the lower triangular L with A = L L' into the corner of `L` that has A's size (above the diagonal untouched),
/// reading A's lower triangle. False if A is not positive definite to working precision. Allocates nothing at any size,
/// which Eigen's blocked factorisation does not promise.
inline bool cholesky(const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& A, Eigen::MatrixXd& L) noexcept {
  // Smallest pivot, as a fraction of its diagonal entry: below it all is cancellation.
  constexpr double singular = 1e-14;
  return with_size(A.rows(), [&](auto n) {
    for (Eigen::Index j = 0; j < n; ++j) {
      double pivot = 0.0;
      for (Eigen::Index k = 0; k < j; ++k) {
        pivot += L(j, k) * L(j, k);
      }
      pivot = A(j, j) - pivot;
      if (!(pivot > singular * A(j, j)) || !(A(j, j) > 0.0)) {
        return false;
      }
      const double diagonal = std::sqrt(pivot);
      L(j, j) = diagonal;
      for (Eigen::Index i = j + 1; i < n; ++i) {
        double product = 0.0;
        for (Eigen::Index k = 0; k < j; ++k) {
          product += L(i, k) * L(j, k);
        }
        L(i, j) = (A(i, j) - product) / diagonal;
      }
    }
    return true;
  });
}

/// x := A x with the factor L of A. Allocates nothing.
inline void multiply_in_place(const Eigen::MatrixXd& L, Eigen::VectorXd& x) noexcept {
  const Eigen::Index n = L.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    x[i] = L.col(i).tail(n - i).dot(x.tail(n - i));
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    x[i] = L.row(i).head(i + 1).dot(x.head(i + 1));
  }
}

/// x := A⁻¹ x with the factor L of A, by its two triangular solves. Allocates nothing.
inline void solve_in_place(const Eigen::MatrixXd& L, Eigen::VectorXd& x) noexcept {
  const Eigen::Index n = L.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    x[i] = (x[i] - L.row(i).head(i).dot(x.head(i))) / L(i, i);
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    x[i] = (x[i] - L.col(i).tail(n - 1 - i).dot(x.tail(n - 1 - i))) / L(i, i);
  }
}

}  // namespace sidestep
