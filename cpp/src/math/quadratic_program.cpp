#include "sidestep/math/quadratic_program.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "finite.hpp"
#include "settings.hpp"
#include "cholesky.hpp"

namespace sidestep {
namespace {

// Violation of a constraint that still counts as rounding, as a fraction of the terms that cancel in it: about 1e4
// roundings, which is what factors of ill-conditioned but usable data lose.
constexpr double feasibility_tolerance = 1e-12;
// Independent part of a normal, as a fraction of it, below which it counts as a combination of the active normals.
constexpr double dependence_tolerance = 1e-11;
// Iterations allowed per constraint. In practice each is added and dropped a few times at most; this bounds the time of a
// hopeless case.
constexpr int iterations_per_constraint = 10;

/// Whether lower <= upper everywhere, without NaN and without a bound at its own infinity.
bool are_consistent(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) noexcept {
  bool consistent = true;
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    consistent = consistent && lower[i] <= upper[i] && lower[i] < infinity && upper[i] > -infinity;
  }
  return consistent;
}

/// Whether a row bounds anything.
bool in_use(const QuadraticProgramData& data, int row) noexcept {
  return data.row_lower[row] != -infinity || data.row_upper[row] != infinity;
}

/// √(a² + b²) of two that are not both zero, as std::hypot, of which the GNU library has a version that older ones lack.
double length_of(double a, double b) noexcept {
  const double large = std::max(std::abs(a), std::abs(b)), ratio = std::min(std::abs(a), std::abs(b)) / large;
  return large * std::sqrt(1.0 + ratio * ratio);
}

}  // namespace

const char* name(QuadraticProgramStatus status) noexcept {
  switch (status) {
    case QuadraticProgramStatus::solved: return "solved";
    case QuadraticProgramStatus::infeasible: return "infeasible";
    case QuadraticProgramStatus::max_iterations: return "max_iterations";
    case QuadraticProgramStatus::not_positive_definite: return "not_positive_definite";
    case QuadraticProgramStatus::not_finite: return "not_finite";
    case QuadraticProgramStatus::wrong_size: return "wrong_size";
  }
  return "unknown";
}

QuadraticProgramData::QuadraticProgramData(int num_variables, int num_rows)
    : H(Eigen::MatrixXd::Identity(num_variables, num_variables)),
      g(Eigen::VectorXd::Zero(num_variables)),
      lower(Eigen::VectorXd::Constant(num_variables, -infinity)),
      upper(Eigen::VectorXd::Constant(num_variables, infinity)),
      A(Eigen::MatrixXd::Zero(num_rows, num_variables)),
      row_lower(Eigen::VectorXd::Constant(num_rows, -infinity)),
      row_upper(Eigen::VectorXd::Constant(num_rows, infinity)) {}

QuadraticProgram::QuadraticProgram(int num_variables, int num_rows) : n_(num_variables), m_(num_rows) {
  if (n_ < 1 || m_ < 0) {
    throw std::invalid_argument("quadratic program: got " + std::to_string(n_) + " variables and " + std::to_string(m_) +
                                " rows, needs at least 1 and 0");
  }
  active_.resize(static_cast<std::size_t>(n_));
  is_active_.resize(static_cast<std::size_t>(n_ + m_));
  cholesky_.setZero(n_, n_);
  J_.setZero(n_, n_);
  R_.setZero(n_, n_);
  x_.setZero(n_);
  multipliers_.setZero(n_ + m_);
  supports_.setZero(m_, n_);
  support_sizes_.setZero(m_);
  row_norms_.setZero(m_);
  u_.setZero(n_);
  d_.setZero(n_);
  r_.setZero(n_);
  z_.setZero(n_);
  y_.setZero(n_);
}

bool QuadraticProgram::factorise(const Eigen::MatrixXd& H) noexcept {
  num_coupled_ = n_;
  while (num_coupled_ > 0 && (H.row(num_coupled_ - 1).head(num_coupled_ - 1).array() == 0.0).all()) {
    --num_coupled_;
  }
  for (int i = num_coupled_; i < n_; ++i) {
    if (!(H(i, i) > 0.0)) {
      return false;
    }
  }
  return cholesky(H.topLeftCorner(num_coupled_, num_coupled_), cholesky_);
}

void QuadraticProgram::start(const QuadraticProgramData& data) noexcept {
  num_active_ = 0;
  std::fill(is_active_.begin(), is_active_.end(), char{0});
  J_.setZero();
  // Uncoupled variables outside a bound begin there; their columns come first, as those of all that is active.
  for (int i = num_coupled_; i < n_; ++i) {
    const double curvature = data.H(i, i), least = -data.g[i] / curvature;
    if (least >= data.lower[i] && least <= data.upper[i]) {
      continue;
    }
    const double sign = least < data.lower[i] ? 1.0 : -1.0;
    const double side = sign > 0.0 ? data.lower[i] : data.upper[i];
    const double scale = 1.0 / std::sqrt(curvature);
    J_(i, num_active_) = sign * scale;
    R_.col(num_active_).head(num_active_).setZero();
    R_(num_active_, num_active_) = scale;
    active_[static_cast<std::size_t>(num_active_++)] = {i, sign, sign * side, data.lower[i] == data.upper[i]};
    is_active_[static_cast<std::size_t>(i)] = 1;
  }
  // J = L^-T of what is coupled: upper triangular, J(j,j) = 1/L(j,j), the rest by back substitution from below.
  for (int j = 0; j < num_coupled_; ++j) {
    auto column = J_.col(num_active_ + j);
    column[j] = 1.0 / cholesky_(j, j);
    for (int i = j - 1; i >= 0; --i) {
      column[i] = -cholesky_.col(i).segment(i + 1, j - i).dot(column.segment(i + 1, j - i)) / cholesky_(i, i);
    }
  }
  for (int i = num_coupled_, j = num_active_ + num_coupled_; i < n_; ++i) {
    if (!is_active_[static_cast<std::size_t>(i)]) {
      J_(i, j++) = 1.0 / std::sqrt(data.H(i, i));
    }
  }
}

void QuadraticProgram::find_supports(const QuadraticProgramData& data) noexcept {
  for (int row = 0; row < m_; ++row) {
    if (!in_use(data, row)) {
      continue;
    }
    int size = 0;
    double squares = 0.0;
    const double* const values = &data.A(row, 0);
    int* const at = &supports_(row, 0);
    for (int i = 0; i < n_; ++i) {
      const double value = values[i];
      at[size] = i;
      size += value != 0.0 ? 1 : 0;
      squares += value * value;
    }
    support_sizes_[row] = size;
    row_norms_[row] = std::sqrt(squares);
  }
}

double QuadraticProgram::along_row(const QuadraticProgramData& data, int row, const Eigen::VectorXd& x) const noexcept {
  const int* const at = &supports_(row, 0);
  const double* const values = &data.A(row, 0);
  double value = 0.0;
  for (int k = 0; k < support_sizes_[row]; ++k) {
    value += values[at[k]] * x[at[k]];
  }
  return value;
}

void QuadraticProgram::project_normal(const QuadraticProgramData& data, int constraint, double sign) noexcept {
  if (constraint < n_) {
    d_.noalias() = sign * J_.row(constraint).transpose();
    return;
  }
  const int row = constraint - n_;
  d_.setZero();
  for (int k = 0; k < support_sizes_[row]; ++k) {
    const int i = supports_(row, k);
    d_ += sign * data.A(row, i) * J_.row(i).transpose();
  }
}

double QuadraticProgram::energy_norm(const QuadraticProgramData& data) const noexcept {
  double sum = 0.0;
  for (int i = 0; i < n_; ++i) {
    double off_diagonal = 0.0;
    for (int j = 0; j < i; ++j) {
      off_diagonal += data.H(i, j) * x_[j];
    }
    sum += x_[i] * (data.H(i, i) * x_[i] + 2.0 * off_diagonal);
  }
  return std::sqrt(std::max(sum, 0.0));
}

double QuadraticProgram::most_violated(const QuadraticProgramData& data, int& constraint, double& sign) const noexcept {
  double worst = 0.0, size = -1.0;  // Largest violation so far, and √(x' H x) once it is needed.
  for (int i = 0; i < n_ + m_; ++i) {
    if (is_active_[static_cast<std::size_t>(i)]) {
      continue;
    }
    double value = 0.0, norm = 1.0, low = 0.0, high = 0.0;
    if (i < n_) {
      value = x_[i];
      low = data.lower[i];
      high = data.upper[i];
    } else {
      if (!in_use(data, i - n_)) {
        continue;
      }
      low = data.row_lower[i - n_];
      high = data.row_upper[i - n_];
      value = along_row(data, i - n_, x_);
      norm = row_norms_[i - n_];
    }
    const bool below = low - value > value - high;
    const double side = below ? low : high;
    const double violation = below ? low - value : value - high;
    if (!(violation > 0.0)) {
      continue;
    }
    const double distance = norm > 0.0 ? violation / norm : infinity;
    if (!(distance > worst)) {
      continue;
    }
    // What cancels in x_i = J_i y is |J_i| |y|, with |y|² = x' H x, at most: a slack of zero is the difference of much
    // more.
    if (i < n_ && size < 0.0) {
      size = energy_norm(data);
    }
    const double terms = i < n_ ? J_.row(i).norm() * size : data.A.row(i - n_).cwiseAbs().dot(x_.cwiseAbs().transpose());
    if (violation > feasibility_tolerance * (terms + std::abs(side))) {
      worst = distance;
      constraint = i;
      sign = below ? 1.0 : -1.0;
    }
  }
  return worst;
}

void QuadraticProgram::add(const Active& active, double multiplier) noexcept {
  // Rotate the columns of J_2 until J_2' n has one entry left, from the last entry upwards.
  for (int j = n_ - 1; j > num_active_; --j) {
    if (d_[j] == 0.0) {
      continue;
    }
    const double length = length_of(d_[j - 1], d_[j]);
    const double c = d_[j - 1] / length, s = d_[j] / length;
    d_[j - 1] = length;
    d_[j] = 0.0;
    for (int i = 0; i < n_; ++i) {
      const double left = J_(i, j - 1), right = J_(i, j);
      J_(i, j - 1) = c * left + s * right;
      J_(i, j) = c * right - s * left;
    }
  }
  R_.col(num_active_).head(num_active_ + 1) = d_.head(num_active_ + 1);
  active_[static_cast<std::size_t>(num_active_)] = active;
  is_active_[static_cast<std::size_t>(active.constraint)] = 1;
  u_[num_active_] = multiplier;
  ++num_active_;
}

void QuadraticProgram::drop(int position) noexcept {
  is_active_[static_cast<std::size_t>(active_[static_cast<std::size_t>(position)].constraint)] = 0;
  // Shift the later columns of R one to the left, then rotate away what stands below the diagonal.
  for (int j = position; j + 1 < num_active_; ++j) {
    active_[static_cast<std::size_t>(j)] = active_[static_cast<std::size_t>(j) + 1];
    u_[j] = u_[j + 1];
    R_.col(j).head(j + 2) = R_.col(j + 1).head(j + 2);
  }
  --num_active_;
  for (int j = position; j < num_active_; ++j) {
    const double length = length_of(R_(j, j), R_(j + 1, j));
    const double c = R_(j, j) / length, s = R_(j + 1, j) / length;
    for (int k = j; k < num_active_; ++k) {
      const double top = R_(j, k), bottom = R_(j + 1, k);
      R_(j, k) = c * top + s * bottom;
      R_(j + 1, k) = c * bottom - s * top;
    }
    for (int i = 0; i < n_; ++i) {
      const double left = J_(i, j), right = J_(i, j + 1);
      J_(i, j) = c * left + s * right;
      J_(i, j + 1) = c * right - s * left;
    }
  }
}

void QuadraticProgram::recompute(const QuadraticProgramData& data) noexcept {
  // With x = J y:  N' x = R' y_1 = b,  y_2 = -J_2' g,  and stationarity  H x + g = N u  reads  y_1 + J_1' g = R u.
  // Directly from the data, so that the rounding of the steps taken so far is gone.
  for (int j = 0; j < n_; ++j) {
    d_[j] = J_.col(j).dot(data.g);
  }
  for (int j = 0; j < num_active_; ++j) {
    y_[j] = (active_[static_cast<std::size_t>(j)].rhs - R_.col(j).head(j).dot(y_.head(j))) / R_(j, j);
  }
  for (int j = num_active_; j < n_; ++j) {
    y_[j] = -d_[j];
  }
  x_.setZero();
  for (int j = 0; j < n_; ++j) {
    x_ += y_[j] * J_.col(j);
  }
  for (int j = num_active_ - 1; j >= 0; --j) {
    double value = y_[j] + d_[j];
    for (int k = j + 1; k < num_active_; ++k) {
      value -= R_(j, k) * u_[k];
    }
    u_[j] = value / R_(j, j);
  }
}

QuadraticProgramStatus QuadraticProgram::solve(const QuadraticProgramData& data) noexcept {
  iterations_ = 0;
  multipliers_.setZero();
  if (data.H.rows() != n_ || data.H.cols() != n_ || data.g.size() != n_ || data.lower.size() != n_ || data.upper.size() != n_ ||
      data.A.rows() != m_ || data.A.cols() != n_ || data.row_lower.size() != m_ || data.row_upper.size() != m_) {
    return QuadraticProgramStatus::wrong_size;
  }
  if (!all_finite(data.H) || !all_finite(data.g) || !all_finite(data.A)) {
    return QuadraticProgramStatus::not_finite;
  }
  if (!are_consistent(data.lower, data.upper) || !are_consistent(data.row_lower, data.row_upper)) {
    const bool unknown = data.lower.hasNaN() || data.upper.hasNaN() || data.row_lower.hasNaN() || data.row_upper.hasNaN();
    return unknown ? QuadraticProgramStatus::not_finite : QuadraticProgramStatus::infeasible;
  }
  if (!factorise(data.H)) {
    return QuadraticProgramStatus::not_positive_definite;
  }
  find_supports(data);
  const QuadraticProgramStatus status = iterate(data, false);
  const bool sure = status == QuadraticProgramStatus::solved || status == QuadraticProgramStatus::not_finite;
  return sure ? status : iterate(data, true);
}

QuadraticProgramStatus QuadraticProgram::iterate(const QuadraticProgramData& data, bool exactly) noexcept {
  iterations_ = 0;
  start(data);
  recompute(data);
  const int max_iterations = iterations_per_constraint * (n_ + m_) + n_;
  bool exact = true;  // without the rounding of steps
  while (true) {
    if (!x_.allFinite()) {
      return QuadraticProgramStatus::not_finite;
    }
    int constraint = -1;
    double sign = 1.0;
    if (most_violated(data, constraint, sign) == 0.0) {
      if (exact) {
        break;
      }
      recompute(data);
      exact = true;
      continue;
    }
    exact = false;
    const bool is_bound = constraint < n_;
    const double low = is_bound ? data.lower[constraint] : data.row_lower[constraint - n_];
    const double high = is_bound ? data.upper[constraint] : data.row_upper[constraint - n_];
    const Active entering{constraint, sign, sign > 0.0 ? low : -high, low == high};
    double multiplier = 0.0;
    // Raise the multiplier of the entering constraint until it holds (full step) or another one's reaches zero.
    while (true) {
      if (++iterations_ > max_iterations) {
        return QuadraticProgramStatus::max_iterations;
      }
      project_normal(data, constraint, sign);
      for (int j = num_active_ - 1; j >= 0; --j) {
        double value = d_[j];
        for (int k = j + 1; k < num_active_; ++k) {
          value -= R_(j, k) * r_[k];
        }
        r_[j] = value / R_(j, j);
      }
      double dual_step = infinity;
      int leaving = -1;
      for (int j = 0; j < num_active_; ++j) {
        if (!active_[static_cast<std::size_t>(j)].equality && r_[j] > 0.0) {
          const double step = std::max(u_[j], 0.0) / r_[j];
          if (step < dual_step) {
            dual_step = step;
            leaving = j;
          }
        }
      }
      const double curvature = d_.tail(n_ - num_active_).squaredNorm();  // n' z
      const bool independent = curvature > dependence_tolerance * dependence_tolerance * d_.squaredNorm();
      double primal_step = infinity;
      if (independent) {
        const double value = is_bound ? x_[constraint] : along_row(data, constraint - n_, x_);
        primal_step = std::max(entering.rhs - sign * value, 0.0) / curvature;
      }
      if (!independent && leaving < 0) {
        return QuadraticProgramStatus::infeasible;
      }
      const double step = std::min(dual_step, primal_step);
      if (independent) {
        z_.setZero();
        for (int j = num_active_; j < n_; ++j) {
          z_ += d_[j] * J_.col(j);
        }
        x_ += step * z_;
      }
      u_.head(num_active_) -= step * r_.head(num_active_);
      multiplier += step;
      if (primal_step <= dual_step) {
        add(entering, multiplier);
        break;
      }
      drop(leaving);
    }
    if (exactly) {
      recompute(data);
      exact = true;
    }
  }
  for (int j = 0; j < num_active_; ++j) {
    const Active& active = active_[static_cast<std::size_t>(j)];
    const double u = active.equality ? u_[j] : std::max(u_[j], 0.0);
    multipliers_[active.constraint] = -active.sign * u;
    if (active.constraint < n_) {
      x_[active.constraint] = active.sign * active.rhs;  // an active bound holds to the last bit
    }
  }
  x_ = x_.cwiseMax(data.lower).cwiseMin(data.upper);  // and the others but for rounding
  return QuadraticProgramStatus::solved;
}

double optimality_residual(const QuadraticProgramData& data, const QuadraticProgram& solved) {
  const Eigen::VectorXd& x = solved.solution();
  const Eigen::Index n = x.size();
  const Eigen::VectorXd& multipliers = solved.multipliers();
  const Eigen::MatrixXd H = data.H.selfadjointView<Eigen::Lower>();
  const auto row_multipliers = multipliers.tail(data.A.rows());

  const Eigen::VectorXd stationarity = H * x + data.g + multipliers.head(n) + data.A.transpose() * row_multipliers;
  const double forces = (H.cwiseAbs() * x.cwiseAbs() + data.g.cwiseAbs() + multipliers.head(n).cwiseAbs() +
                         data.A.cwiseAbs().transpose() * row_multipliers.cwiseAbs())
                            .maxCoeff();
  double residual = forces > 0.0 ? stationarity.cwiseAbs().maxCoeff() / forces : 0.0;

  const auto check = [&](double value, double terms, double low, double high, double multiplier) {
    const double side = multiplier > 0.0 ? high : low;
    const double scale = terms + std::abs(std::isfinite(side) ? side : 0.0);
    const double outside = std::max({low - value, value - high, 0.0});
    const double gap = multiplier != 0.0 ? std::abs(value - side) : 0.0;
    if (scale > 0.0) {
      residual = std::max({residual, outside / scale, gap / scale});
    } else if (outside > 0.0 || gap > 0.0) {
      residual = infinity;
    }
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    check(x[i], std::abs(x[i]), data.lower[i], data.upper[i], multipliers[i]);
  }
  for (Eigen::Index k = 0; k < data.A.rows(); ++k) {
    check(data.A.row(k).dot(x), data.A.row(k).cwiseAbs().dot(x.cwiseAbs().transpose()), data.row_lower[k], data.row_upper[k],
          row_multipliers[k]);
  }
  return residual;
}

}  // namespace sidestep
