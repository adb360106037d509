#include "sidestep/math/quadratic_program.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <limits>
#include <stdexcept>

#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"

using namespace sidestep;
using test::infinity;
using test::Random;
using boost::test_tools::tolerance;

namespace {

// Conditioning of H up to 1e8 and of active sets up to about 1e3 leave this much of the 1e-16 of a rounding.
constexpr double optimality = 1e-9;

QuadraticProgramData random_program(Random& random, int n, int m) {
  QuadraticProgramData data(n, m);
  data.H = random.positive_definite(n, random.magnitude(1e-6, 1.0));
  data.g = random.magnitude(1e-2, 1e3) * random.vector(n);
  data.A = random.matrix(m, n);
  return data;
}

/// Bounds around a point, so that the program is feasible: some infinite, some touching the point, some equal.
void set_bounds_around(Random& random, const Eigen::VectorXd& value, Eigen::VectorXd& lower, Eigen::VectorXd& upper) {
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const double kind = random.uniform(0.0, 1.0);
    lower[i] = kind < 0.1 ? -infinity : kind < 0.25 ? value[i] : value[i] - random.magnitude(1e-6, 1.0);
    upper[i] = kind > 0.9 ? infinity : kind > 0.2 && kind < 0.35 ? value[i] : value[i] + random.magnitude(1e-6, 1.0);
  }
}

void require_optimal(const QuadraticProgramData& data, QuadraticProgram& program, int trial) {
  const QuadraticProgramStatus status = program.solve(data);
  BOOST_REQUIRE_MESSAGE(status == QuadraticProgramStatus::solved, "trial " << trial << ": " << name(status));
  const double residual = optimality_residual(data, program);
  BOOST_REQUIRE_MESSAGE(residual < optimality, "trial " << trial << ": residual " << residual);
}

}  // namespace

BOOST_AUTO_TEST_CASE(unconstrained_minimum) {
  QuadraticProgramData data(2, 0);
  data.H << 2.0, 0.5, 0.5, 1.0;
  data.g << -1.0, 1.0;
  QuadraticProgram program(2, 0);
  BOOST_TEST((program.solve(data) == QuadraticProgramStatus::solved));
  // H x = -g by hand: det = 1.75, x = (1.5, -2.5)/1.75. Rounding of a 2 x 2 solve.
  BOOST_TEST(program.solution()[0] == 1.5 / 1.75, tolerance(1e-14));
  BOOST_TEST(program.solution()[1] == -2.5 / 1.75, tolerance(1e-14));
  BOOST_TEST(program.iterations() == 0);
}

BOOST_AUTO_TEST_CASE(signs_of_the_multipliers) {
  QuadraticProgramData data(2, 1);
  data.g << -3.0, 0.0;  // wants x = (3, 0)
  data.upper[0] = 1.0;
  data.A << 1.0, 1.0;
  data.row_lower[0] = 2.0;
  QuadraticProgram program(2, 1);
  BOOST_TEST((program.solve(data) == QuadraticProgramStatus::solved));
  BOOST_TEST(program.solution()[0] == 1.0);
  BOOST_TEST(program.solution()[1] == 1.0, tolerance(1e-14));
  // H x + g + multipliers + A' row_multipliers = 0 reads (1 - 3 + 3 - 1, 1 + 0 + 0 - 1). Roundings of size 3e-16.
  BOOST_TEST(program.multipliers()[0] == 3.0, tolerance(1e-14));
  BOOST_TEST(program.multipliers()[1] == 0.0);
  BOOST_TEST(program.multipliers()[2] == -1.0, tolerance(1e-14));
}

BOOST_AUTO_TEST_CASE(random_feasible_programs) {
  Random random(1);
  int most_iterations = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const int n = random.integer(1, 16), m = random.integer(0, 24);
    QuadraticProgramData data = random_program(random, n, m);
    const Eigen::VectorXd feasible = random.vector(n);
    set_bounds_around(random, feasible, data.lower, data.upper);
    set_bounds_around(random, data.A * feasible, data.row_lower, data.row_upper);
    // Keep equalities on the bounds: with more than n of them, rounding decides whether they meet.
    for (int k = 0; k < m; ++k) {
      if (data.row_lower[k] == data.row_upper[k]) {
        data.row_upper[k] += 1.0;
      }
    }
    QuadraticProgram program(n, m);
    require_optimal(data, program, trial);
    most_iterations = std::max(most_iterations, program.iterations());
  }
  BOOST_TEST(most_iterations < 200);  // of 416 allowed for the largest of them; 104 seen
}

BOOST_AUTO_TEST_CASE(equality_rows) {
  Random random(8);
  for (int trial = 0; trial < 3000; ++trial) {
    const int n = random.integer(2, 12), m = random.integer(1, n - 1);
    QuadraticProgramData data = random_program(random, n, m);
    const Eigen::VectorXd feasible = random.vector(n);
    data.row_lower = data.row_upper = data.A * feasible;
    data.upper.setConstant(feasible.maxCoeff() + 0.1);
    QuadraticProgram program(n, m);
    require_optimal(data, program, trial);
  }
}

BOOST_AUTO_TEST_CASE(duplicate_and_dependent_rows) {
  Random random(2);
  for (int trial = 0; trial < 3000; ++trial) {
    const int n = random.integer(2, 10), half = random.integer(2, 8), m = 2 * half + 2;
    QuadraticProgramData data = random_program(random, n, m);
    // The second half repeats the first one in other units; two rows more are combinations of others.
    for (int k = 0; k < half; ++k) {
      data.A.row(half + k) = random.magnitude(1e-3, 1e3) * (random.chance(0.5) ? 1.0 : -1.0) * data.A.row(k);
    }
    data.A.row(2 * half) = data.A.row(0) + data.A.row(half - 1);
    data.A.row(2 * half + 1) = data.A.row(0) - 2.0 * data.A.row(1);
    const Eigen::VectorXd feasible = random.vector(n);
    for (int k = 0; k < m; ++k) {  // both of a pair bound the same place
      const double value = data.A.row(k).dot(feasible), width = 0.1 * data.A.row(k).norm();
      data.row_lower[k] = value - width;
      data.row_upper[k] = value + width;
    }
    QuadraticProgram program(n, m);
    require_optimal(data, program, trial);
  }
}

BOOST_AUTO_TEST_CASE(more_constraints_than_dimensions_meet_in_the_solution) {
  // A degenerate vertex: many half spaces touch the point that is best in all of them.
  Random random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const int n = random.integer(2, 8), m = 3 * n;
    QuadraticProgramData data = random_program(random, n, m);
    const Eigen::VectorXd vertex = random.vector(n);
    data.row_upper = data.A * vertex;
    // The gradient at the vertex is minus a positive combination of the normals, so the vertex is optimal.
    data.g = -data.H * vertex - data.A.transpose() * random.vector(m).cwiseAbs();
    QuadraticProgram program(n, m);
    const QuadraticProgramStatus status = program.solve(data);
    BOOST_REQUIRE_MESSAGE(status == QuadraticProgramStatus::solved, "trial " << trial << ": " << name(status));
    // The vertex comes out of an n x n system of random normals, of condition up to about 1e5.
    BOOST_REQUIRE_SMALL((program.solution() - vertex).norm() / (1.0 + vertex.norm()), 1e-8);
  }
}

BOOST_AUTO_TEST_CASE(equal_bounds_fix_variables) {
  Random random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    const int n = random.integer(2, 8), fixed = random.integer(1, n);
    QuadraticProgramData data = random_program(random, n, 1);
    data.lower.head(fixed) = data.upper.head(fixed) = random.vector(fixed);
    QuadraticProgram program(n, 1);
    require_optimal(data, program, trial);
    BOOST_REQUIRE((program.solution().head(fixed).array() == data.lower.head(fixed).array()).all());
  }
}

BOOST_AUTO_TEST_CASE(infeasible_programs_are_recognised) {
  Random random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    const int n = random.integer(1, 8), m = random.integer(2, 10);
    QuadraticProgramData data = random_program(random, n, m);
    // Farkas: the last row is minus a positive combination of the others, and asks for more than they leave.
    const Eigen::VectorXd weights = random.vector(m - 1).cwiseAbs();
    data.A.row(m - 1) = -weights.transpose() * data.A.topRows(m - 1);
    data.row_lower.head(m - 1) = random.vector(m - 1);
    const double least = weights.dot(data.row_lower.head(m - 1));
    data.row_lower[m - 1] = -least + random.magnitude(1e-6, 1.0) * (1.0 + std::abs(least));
    QuadraticProgram program(n, m);
    const QuadraticProgramStatus status = program.solve(data);
    BOOST_REQUIRE_MESSAGE(status == QuadraticProgramStatus::infeasible, "trial " << trial << ": " << name(status));
  }
}

BOOST_AUTO_TEST_CASE(units_do_not_matter) {
  // The same program with its variables in other units has the same solution in these units.
  Random random(6);
  for (int trial = 0; trial < 1000; ++trial) {
    const int n = random.integer(1, 8), m = random.integer(0, 8);
    QuadraticProgramData data = random_program(random, n, m);
    data.lower.setConstant(-1.0);
    data.upper.setConstant(1.0);
    data.row_lower.setConstant(-1.0);
    data.row_upper.setConstant(0.5);
    QuadraticProgramData scaled = data;
    Eigen::VectorXd units(n);
    for (int i = 0; i < n; ++i) {
      units[i] = random.magnitude(1e-4, 1e4);
    }
    scaled.H = units.asDiagonal() * data.H * units.asDiagonal();
    scaled.g = units.asDiagonal() * data.g;
    scaled.A = data.A * units.asDiagonal();
    scaled.lower = data.lower.cwiseQuotient(units);
    scaled.upper = data.upper.cwiseQuotient(units);
    QuadraticProgram program(n, m), other(n, m);
    require_optimal(data, program, trial);
    BOOST_REQUIRE(other.solve(scaled) == QuadraticProgramStatus::solved);
    // Both are exact up to the conditioning of H, here up to 1e8.
    BOOST_REQUIRE_SMALL((program.solution() - units.cwiseProduct(other.solution())).norm(), 1e-7);
  }
}

BOOST_AUTO_TEST_CASE(unusable_data_give_a_status) {
  using D = QuadraticProgramData;
  using S = QuadraticProgramStatus;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  QuadraticProgram program(2, 1);
  const auto status_of = [&](auto&& change) {
    QuadraticProgramData data(2, 1);
    change(data);
    return program.solve(data);
  };
  BOOST_TEST((status_of([](D&) {}) == S::solved));
  BOOST_TEST((status_of([&](D& d) { d.H(1, 0) = nan; }) == S::not_finite));
  BOOST_TEST((status_of([&](D& d) { d.g[1] = infinity; }) == S::not_finite));
  BOOST_TEST((status_of([&](D& d) { d.A(0, 1) = nan; }) == S::not_finite));
  BOOST_TEST((status_of([&](D& d) { d.upper[0] = nan; }) == S::not_finite));
  BOOST_TEST((status_of([&](D& d) { d.row_lower[0] = nan; }) == S::not_finite));
  BOOST_TEST((status_of([&](D& d) { d.H(1, 1) = 0.0; }) == S::not_positive_definite));
  BOOST_TEST((status_of([&](D& d) { d.H(1, 1) = -1.0; }) == S::not_positive_definite));
  BOOST_TEST((status_of([&](D& d) { d.H.setOnes(); }) == S::not_positive_definite));
  BOOST_TEST((status_of([&](D& d) { d.lower[0] = 1.0, d.upper[0] = 0.0; }) == S::infeasible));
  BOOST_TEST((status_of([&](D& d) { d.lower[0] = infinity; }) == S::infeasible));
  BOOST_TEST((status_of([&](D& d) { d.row_upper[0] = -infinity; }) == S::infeasible));
  BOOST_TEST((status_of([&](D& d) { d.row_lower[0] = 1.0; }) == S::infeasible));  // 0 x >= 1
  BOOST_TEST((status_of([&](D& d) { d.g.resize(3); }) == S::wrong_size));
  BOOST_CHECK_THROW(QuadraticProgram(0, 1), std::invalid_argument);
  BOOST_CHECK_THROW(QuadraticProgram(1, -1), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(the_residual_sees_a_wrong_solution) {
  QuadraticProgramData data(2, 0), other(2, 0);
  data.g << -1.0, 0.0;
  other.g << -1.1, 0.0;
  QuadraticProgram program(2, 0);
  BOOST_REQUIRE(program.solve(data) == QuadraticProgramStatus::solved);
  BOOST_TEST(optimality_residual(data, program) < 1e-15);
  BOOST_TEST(optimality_residual(other, program) > 0.01);
  other = data;
  other.upper[0] = 0.5;
  BOOST_TEST(optimality_residual(other, program) > 0.1);
}

BOOST_AUTO_TEST_CASE(solve_allocates_nothing) {
  Random random(7);
  int solved = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const int n = random.integer(1, 40), m = random.integer(0, 40);
    QuadraticProgramData data = random_program(random, n, m);
    data.lower.setConstant(-0.3);
    data.upper.setConstant(0.3);
    if (random.chance(0.5)) {
      data.row_lower.setConstant(5.0);  // out of reach within these bounds, for most rows
    }
    QuadraticProgram program(n, m);
    QuadraticProgramStatus status{};
    BOOST_REQUIRE_EQUAL(test::allocations_of([&] { status = program.solve(data); }), 0u);
    solved += status == QuadraticProgramStatus::solved;
  }
  BOOST_TEST(solved > 20);
  BOOST_TEST(solved < 180);
}
