// What Python cannot see: no allocation, and the smooth maximum's own derivative. The rest is tested from Python.
#include "sidestep/dynamical_system/speed_regulator.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "support/allocations.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;

BOOST_AUTO_TEST_CASE(the_ratio_obeys_its_bound_and_nothing_is_allocated) {
  test::Random random(0);
  constexpr int nv = 7;
  const JointLimits limits = test::arm_limits(nv);
  const SpeedRegulator regulator({0.8, 10.0, 0.2, 1.0});
  for (int trial = 0; trial < 1000; ++trial) {
    Clearances clearances(nv, 12);
    clearances.gradients = 0.3 * random.matrix(nv, 12);
    Eigen::VectorXd v = random.magnitude(0.1, 1.5) * random.vector(nv);
    const Eigen::VectorXd a = 10.0 * random.vector(nv);
    for (int k = 0; k < 12; ++k) {
      clearances.nearest[k] = random.chance(0.5) ? k : -1;
      clearances.values[k] = random.uniform(0.01, 0.3);
    }
    clearances.rates = clearances.gradients.transpose() * v;  // planes: no curvature
    SpeedRegulator::Result result{};
    BOOST_REQUIRE_EQUAL(test::allocations_of([&] { result = regulator(v, a, limits, clearances); }), 0u);
    BOOST_REQUIRE_LE(result.drag, 0.0);
    // Central difference of rho along the regulated motion, over 2e-6 s.
    const double dt = 1e-6;
    const auto ratio_at = [&](double t) {
      Clearances moved = clearances;
      const Eigen::VectorXd later = v + t * (a + result.drag * v);
      moved.values += t * clearances.rates;
      moved.rates = clearances.gradients.transpose() * later;
      return regulator(later, a, limits, moved).ratio;
    };
    const double slope = (ratio_at(dt) - ratio_at(-dt)) / (2.0 * dt);
    const double bound = 10.0 * (1.0 - result.ratio) / std::min(result.ratio, 1.0);
    // Truncation: dt^2 times third derivatives up to 1e4; rounding 1e-16 · 5/dt.
    BOOST_REQUIRE_LE(slope, bound + 1e-6 * (1.0 + std::abs(bound)));
    if (result.drag < 0.0) {
      BOOST_REQUIRE_CLOSE_FRACTION(slope, bound, 1e-5);
    }
  }
}
