#include "sidestep/attractor/clearance_barrier.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "sidestep/attractor/embedding.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;

namespace {

constexpr int nv = 3;

/// Of the coordinates 0 and 2 of an arm, by control points along the first.
template <class Control>
PairDistanceTableBarrier barrier_of(Control&& control) {
  PairDistanceTable table{"tip", "tip", {PairDistanceTable::Axis{0, -2.0, 0.1, false}, {2, -2.0, 1.0, false}}, {}};
  table.control.resize(41, 5);
  for (int i = 0; i < table.control.rows(); ++i) {
    table.control.row(i).setConstant(control(-2.0 + 0.1 * i));
  }
  return PairDistanceTableBarrier(test::serial_arm(test::arm_limits(nv)), {table}, {0.05, 1.0, 2.0, 0.002});
}

EmbeddingEvaluation at(const PairDistanceTableBarrier& barrier, double q, double v) {
  return evaluate(barrier, Eigen::Vector3d(q, 0.0, 0.0), Eigen::Vector3d(v, 0.1, 0.0), Obstacles::none());
}

}  // namespace

BOOST_AUTO_TEST_CASE(behind_a_crest_the_other_slope_is_minded) {
  // 40 mm at the crest q = 0, and 0.1 m/rad down on either side. From 2 rad/s the arm stops in 0.2 rad.
  const PairDistanceTableBarrier barrier = barrier_of([](double q) { return 0.04 - 0.1 * std::abs(q); });
  const auto close = boost::test_tools::tolerance(1e-12);
  const EmbeddingEvaluation before = at(barrier, -0.25, 2.0);  // the stop ends 0.05 rad before the crest, rounded off
  BOOST_TEST(before.clearances.values[0] == 0.015, close);
  BOOST_TEST(before.clearances.rates[0] == 0.2, close);
  BOOST_TEST(before.clearances.approach.rates[0] > 0.0);

  const EmbeddingEvaluation near = at(barrier, -0.1, 2.0);
  BOOST_TEST(near.clearances.values[0] == 0.03, close);
  BOOST_TEST(near.clearances.rates[0] == 0.2, close);
  const Clearances& minded = near.clearances;
  BOOST_TEST(minded.approach.values[0] == 0.04 + 0.01, close);  // of the far slope, continued to here
  BOOST_TEST(minded.approach.rates[0] == -0.2, close);
  BOOST_TEST((minded.approach.gradients.col(0) - Eigen::Vector3d(-0.1, 0.0, 0.0)).norm() < 1e-12);  // rounding
  BOOST_TEST(std::abs(minded.approach.curvatures[0]) < 1e-9);  // the slope is straight: rounding

  const EmbeddingEvaluation away = at(barrier, 0.15, -0.1);  // slowly back: the stop ends before the crest
  BOOST_TEST(away.clearances.approach.values[0] == 0.025, close);
  BOOST_TEST(away.clearances.approach.rates[0] == 0.01, close);
}

BOOST_AUTO_TEST_CASE(in_a_hollow_what_is_nearest_is_minded) {
  // A B-spline lifts the parabola of its control points by a third of the square of their distance.
  const PairDistanceTableBarrier barrier = barrier_of([](double q) { return 0.03 + 0.1 * (q * q - 0.01 / 3.0); });
  const auto close = boost::test_tools::tolerance(1e-9);
  for (double q : {-0.3, 0.0, 0.2}) {
    const Clearances found = at(barrier, q, 2.0).clearances;
    BOOST_TEST(found.values[0] == 0.03 + 0.1 * q * q, close);
    BOOST_TEST(found.approach.values[0] == found.values[0], close);
    BOOST_TEST(found.approach.rates[0] == found.rates[0], close);
    BOOST_TEST(found.approach.curvatures[0] == 0.2 * 4.0, close);
  }
}
