#pragma once

#include <Eigen/Core>

namespace sidestep {

/// Whether every entry is finite: x − x is then zero.
inline bool all_finite(const Eigen::Ref<const Eigen::VectorXd>& x) noexcept {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    sum += x[i] - x[i];
  }
  return sum == 0.0;
}

}  // namespace sidestep
