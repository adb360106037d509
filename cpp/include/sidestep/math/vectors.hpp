#pragma once

#include <Eigen/Core>
#include <type_traits>

namespace sidestep {

/// A vector that a function reads.
using ConstVectorRef = const Eigen::Ref<const Eigen::VectorXd>&;

/// Calls `f` with the number of joint coordinates. Common numbers are passed as compile-time constants, so that loops are
/// unrolled: for so few coordinates loop counters cost more than the arithmetic.
template <class F>
decltype(auto) with_size(Eigen::Index nv, F&& f) {
  switch (nv) {
    case 6: return f(std::integral_constant<Eigen::Index, 6>{});
    case 7: return f(std::integral_constant<Eigen::Index, 7>{});
    default: return f(nv);
  }
}

/// The numbers from `data` on as a vector of the size that with_size gave.
template <class Scalar, Eigen::Index N>
auto sized(Scalar* data, std::integral_constant<Eigen::Index, N>) noexcept {
  using Vector = Eigen::Matrix<double, static_cast<int>(N), 1>;
  return Eigen::Map<std::conditional_t<std::is_const_v<Scalar>, const Vector, Vector>>(data);
}
template <class Scalar>
auto sized(Scalar* data, Eigen::Index nv) noexcept {
  return Eigen::Map<std::conditional_t<std::is_const_v<Scalar>, const Eigen::VectorXd, Eigen::VectorXd>>(data, nv);
}

/// A vector, or a column of a matrix, seen as one of that size.
template <class Vector, class Size>
auto sized(Vector&& vector, Size nv) noexcept {
  return sized(vector.data(), nv);
}

}  // namespace sidestep
