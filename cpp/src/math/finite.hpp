#pragma once

#include <Eigen/Core>

namespace sidestep {

/// Whether every entry is finite: x − x is then zero.
template <class Vector>
bool all_finite(const Eigen::MatrixBase<Vector>& x) noexcept {
  return (x - x).sum() == 0.0;
}

}  // namespace sidestep
