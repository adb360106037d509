#pragma once

#include <Eigen/Core>
#include <utility>

namespace sidestep {

/// A square gain matrix; a diagonal one costs only what its diagonal does.
class Gain {
 public:
  explicit Gain(Eigen::MatrixXd matrix)
      : matrix_(std::move(matrix)), diagonal_(matrix_.diagonal()), is_diagonal_(matrix_.isDiagonal(0.0)) {}

  /// result = matrix x. No allocation.
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& result) const noexcept {
    if (is_diagonal_) {
      result = diagonal_.cwiseProduct(x);
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
