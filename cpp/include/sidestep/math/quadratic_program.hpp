#pragma once

#include <Eigen/Core>
#include <vector>

namespace sidestep {

/// @cond internal
/// How a solve ended. Only after `solved` is the solution meaningful.
enum class QuadraticProgramStatus {
  solved,
  infeasible,             ///< No point satisfies every constraint.
  max_iterations,         ///< Gave up: numerically hopeless data.
  not_positive_definite,  ///< The Cholesky factorisation of H failed.
  not_finite,             ///< NaN anywhere, or an infinity in H, g or A
  wrong_size,             ///< The data do not have the size of the solver.
};

/// A short name, for example "solved".
const char* name(QuadraticProgramStatus status) noexcept;
/// @endcond

/// The data of   minimise 1/2 x'Hx + g'x   subject to   lower <= x <= upper,   row_lower <= A x <= row_upper.
/// Bounds may be infinite; equal bounds make an equality. Starts as H = I, g = 0, A = 0 and no bounds.
struct QuadraticProgramData {
  QuadraticProgramData(int num_variables, int num_rows);

  Eigen::MatrixXd H;             ///< Cost matrix (n, n), symmetric positive definite; the lower triangle is read.
  Eigen::VectorXd g;             ///< Cost vector (n).
  Eigen::VectorXd lower, upper;  ///< Bounds of the variables (n).
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> A;  ///< Rows (m, n).
  Eigen::VectorXd row_lower, row_upper;                                      ///< Bounds of the rows (m).
};

/// A dense strictly convex quadratic program of fixed size, solved by the dual active-set method.
///
/// Starts at the unconstrained minimum and adds violated constraints one by one, dropping those whose multiplier
/// would change sign; every iterate is optimal for its active set, so the dual objective only rises and the method
/// ends after finitely many steps, with the exact solution or a proof of infeasibility (Goldfarb and Idnani, "A
/// numerically stable dual method for solving strictly convex quadratic programs", 1983). The factors of the active
/// set are updated by Givens rotations. The result depends on the data alone: there is no warm start to go stale.
///
/// Slack variables are cheap where they come last: variables that H does not couple to any other start at the bound
/// that they violate, and of rows only the entries that are not zero are read.
///
/// Memory is taken at construction; `solve` allocates nothing. One object per thread.
class QuadraticProgram {
 public:
  /// Throws std::invalid_argument unless num_variables >= 1 and num_rows >= 0.
  QuadraticProgram(int num_variables, int num_rows);

  int num_variables() const noexcept { return n_; }
  int num_rows() const noexcept { return m_; }

  [[nodiscard]] QuadraticProgramStatus solve(const QuadraticProgramData& data) noexcept;

  /// The minimiser (n).
  const Eigen::VectorXd& solution() const noexcept { return x_; }
  /// Multipliers (n + m): bounds first, then rows; positive at an upper limit, negative at a lower one, 0 if inactive.
  /// They satisfy  H x + g + multipliers[:n] + A' multipliers[n:] = 0.
  const Eigen::VectorXd& multipliers() const noexcept { return multipliers_; }
  /// Number of constraints added or dropped by the last solve.
  int iterations() const noexcept { return iterations_; }

 private:
  // Constraint i < n_ is the bound of variable i, constraint n_ + k is row k. An active constraint sits at one of
  // its sides; its inward normal is sign * (row of the constraint), sign = +1 at the lower and -1 at the upper side.
  struct Active {
    int constraint = 0;
    double sign = 1.0;
    double rhs = 0.0;       // Value of that side, times `sign`.
    bool equality = false;  // Whether it is an equality: never dropped, multiplier of any sign.
  };

  bool factorise(const Eigen::MatrixXd& H) noexcept;
  /// Exactly: without the rounding of steps at every iteration, not only at the end.
  QuadraticProgramStatus iterate(const QuadraticProgramData& data, bool exactly) noexcept;
  void start(const QuadraticProgramData& data) noexcept;
  void find_supports(const QuadraticProgramData& data) noexcept;
  double along_row(const QuadraticProgramData& data, int row, const Eigen::VectorXd& x) const noexcept;
  void project_normal(const QuadraticProgramData& data, int constraint, double sign) noexcept;
  /// √(x' H x).
  double energy_norm(const QuadraticProgramData& data) const noexcept;
  double most_violated(const QuadraticProgramData& data, int& constraint, double& sign) const noexcept;
  void add(const Active& active, double multiplier) noexcept;
  void drop(int position) noexcept;
  void recompute(const QuadraticProgramData& data) noexcept;

  int n_, m_;
  int num_active_ = 0;
  int iterations_ = 0;
  std::vector<Active> active_;   // Active constraints (n), the first num_active_ in use.
  std::vector<char> is_active_;  // Whether a constraint is active (n + m).
  Eigen::MatrixXd cholesky_;     // L of the coupled part, H = L L'
  Eigen::MatrixXd J_;            // L^-T times an orthogonal matrix, so J' H J = I; J' N = [R; 0]
  Eigen::MatrixXd R_;            // Upper triangular factor, (num_active_, num_active_) in use; N: active normals.
  Eigen::VectorXd x_, multipliers_;
  int num_coupled_ = 0;  // Size of the leading block of H that is not diagonal.
  // (m, n) where rows of A in use are not zero
  Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> supports_;
  Eigen::VectorXi support_sizes_;  // Number of nonzero entries of each row (m).
  Eigen::VectorXd row_norms_;      // Norms of the rows of A.
  Eigen::VectorXd u_;              // Multipliers of the active constraints, >= 0 for inequalities.
  Eigen::VectorXd d_, r_, z_, y_;  // J' n, R^-1 d_1, step direction J_2 d_2, coordinates of x in J
};

/// The largest violation of the optimality conditions at the solver's solution: stationarity, feasibility, sign and
/// complementarity of the multipliers, each divided by the size of the terms that cancel in it. About 1e-15 when
/// solved.
double optimality_residual(const QuadraticProgramData& data, const QuadraticProgram& solved);

}  // namespace sidestep
