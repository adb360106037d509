#include "sidestep/attractor/one_sided_metric.hpp"

#include "sidestep/math/vectors.hpp"

namespace sidestep {
namespace {

// Passes of Newton's method on S, which usually ends after two to four. From then on S only grows: that ends by itself, and
// resists more than necessary, never less.
constexpr int newton_passes = 8;
constexpr int most_passes = 16;  // Most passes in all.

}  // namespace

OneSidedMetric::OneSidedMetric(int nv, int m)
    : metric_(nv, m),
      columns_(Eigen::MatrixXd::Zero(nv, m)),
      resisting_(Eigen::MatrixXd::Zero(nv, m)),
      in_set_(static_cast<std::size_t>(m), 0),
      start_(Eigen::VectorXd::Zero(nv)) {}

void OneSidedMetric::solve_in_place(const Eigen::Ref<const Eigen::MatrixXd>& jacobian_transposed,
                                    Eigen::Ref<Eigen::VectorXd> x) noexcept {
  Eigen::Index used = 0;
  with_size(jacobian_transposed.rows(), [&](auto nv) {
    for (Eigen::Index k = 0; k < jacobian_transposed.cols(); ++k) {
      const auto column = sized(jacobian_transposed.data() + k * jacobian_transposed.outerStride(), nv);
      if (column.cwiseAbs().sum() != 0.0) {
        sized(columns_.col(used), nv) = column;
        in_set_[static_cast<std::size_t>(used++)] = 0;
      }
    }
  });
  resisting_.leftCols(used).setZero();
  start_ = x;
  for (int pass = 0; pass < most_passes; ++pass) {
    bool changed = false;
    with_size(x.size(), [&](auto nv) {
      for (Eigen::Index k = 0; k < used; ++k) {
        const auto column = sized(columns_.col(k), nv);
        char& in_set = in_set_[static_cast<std::size_t>(k)];
        const bool resists = column.dot(sized(x, nv)) > 0.0 || (in_set != 0 && pass >= newton_passes);
        if (resists != (in_set != 0)) {
          in_set = resists ? 1 : 0;
          sized(resisting_.col(k), nv) = in_set * column;
          changed = true;
        }
      }
    });
    if (!changed) {
      return;
    }
    metric_.update(resisting_.leftCols(used));
    x = start_;
    metric_.solve_in_place(x);
  }
}

}  // namespace sidestep
