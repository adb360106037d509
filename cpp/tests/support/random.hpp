#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>

namespace sidestep::test {

/// Seeded random numbers, vectors and matrices.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}

  double uniform(double low, double high) { return low + (high - low) * unit_(engine_); }
  /// Uniform in the logarithm: every order of magnitude is as likely.
  double magnitude(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  double normal() { return normal_(engine_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }
  bool chance(double probability) { return unit_(engine_) < probability; }

  Eigen::VectorXd vector(int n) {
    return Eigen::VectorXd::NullaryExpr(n, [this](Eigen::Index) { return normal(); });
  }
  Eigen::MatrixXd matrix(int rows, int cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols, [this](Eigen::Index, Eigen::Index) { return normal(); });
  }
  /// Symmetric, eigenvalues at least `smallest`.
  Eigen::MatrixXd positive_definite(int n, double smallest) {
    const Eigen::MatrixXd B = matrix(n, n);
    return B * B.transpose() + smallest * Eigen::MatrixXd::Identity(n, n);
  }

 private:
  std::mt19937_64 engine_;
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

}  // namespace sidestep::test
