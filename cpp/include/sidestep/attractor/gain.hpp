#pragma once

#include <Eigen/Core>
#include <utility>

#include "sidestep/math/vectors.hpp"

namespace sidestep {

/// A square gain matrix; a diagonal one costs only what its diagonal does.
class Gain {
 public:
  explicit Gain(Eigen::MatrixXd matrix)
      : matrix_(std::move(matrix)), diagonal_(matrix_.diagonal()), is_diagonal_(matrix_.isDiagonal(0.0)) {}

  /// result = matrix x, which do not overlap; `nv` is from with_size. No allocation.
  template <class Vector, class Result, class Size>
  void multiply(const Vector& x, Result&& result, Size nv) const noexcept {
    if (is_diagonal_) {
      result = sized(diagonal_, nv).cwiseProduct(x);
    } else {
      result = matrix_.lazyProduct(x);
    }
  }

 private:
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd diagonal_;
  bool is_diagonal_;
};

}  // namespace sidestep
