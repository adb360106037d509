// Stops from random states: they end at rest, exactly, and keep every limit on the way.
#include "sidestep/guard/stop_trajectory.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::nv;
using test::Random;

namespace {

constexpr double T = 0.001;

struct Moving {
  Eigen::VectorXd q, v, a;
};

/// Anywhere within half of the position range, so that the position limits do not bind.
Moving random_state(Random& random, const JointLimits& limits) {
  Moving state{Eigen::VectorXd(nv), Eigen::VectorXd(nv), Eigen::VectorXd(nv)};
  for (Eigen::Index j = 0; j < nv; ++j) {
    const double middle = 0.5 * (limits.lower[j] + limits.upper[j]), half = 0.5 * (limits.upper[j] - limits.lower[j]);
    state.q[j] = middle + 0.5 * half * random.uniform(-1.0, 1.0);
    state.v[j] = 0.8 * limits.velocity[j] * random.uniform(-1.0, 1.0);
    const double left = limits.velocity[j] - std::abs(state.v[j]);  // a rises the speed by a²/2J until it is zero
    state.a[j] = std::min(limits.acceleration[j], std::sqrt(limits.jerk[j] * left)) * random.uniform(-1.0, 1.0);
  }
  return state;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_stop_ends_at_rest_and_keeps_every_limit) {
  Random random(5);
  JointLimits limits = test::arm_limits(nv);
  for (int trial = 0; trial < 200; ++trial) {
    limits.jerk = Eigen::VectorXd::NullaryExpr(nv, [&](Eigen::Index) { return random.magnitude(50.0, 1e4); });
    const Moving begin = random_state(random, limits);
    StopTrajectory stop(nv);
    BOOST_REQUIRE(stop.plan(begin.q, begin.v, begin.a, limits, T));
    Eigen::VectorXd q = begin.q, v = begin.v, last = begin.a, a(nv), there(nv), farthest = Eigen::VectorXd::Zero(nv);
    while (stop.num_periods() > 0) {
      stop.acceleration(0, a);
      v += T * a;
      q += T * v;
      constexpr double rounding = 1e-7;
      BOOST_REQUIRE(((a - last).array().abs() <= T * limits.jerk.array() * (1.0 + rounding)).all());
      BOOST_REQUIRE((a.array().abs() <= limits.acceleration.array() * (1.0 + rounding)).all());
      BOOST_REQUIRE((v.array().abs() <= limits.velocity.array() * (1.0 + rounding)).all());
      BOOST_REQUIRE((q.array() <= limits.upper.array() + rounding && q.array() >= limits.lower.array() - rounding).all());
      farthest = farthest.cwiseMax((q - begin.q).cwiseAbs());
      last = a;
      stop.position(1, there);
      BOOST_REQUIRE((there - q).cwiseAbs().maxCoeff() < 1e-10);
      stop.advance();
    }
    BOOST_TEST(a.norm() == 0.0);
    BOOST_TEST(v.norm() < 1e-10);                                         // rounding of sums
    BOOST_TEST((farthest.array() <= stop.way().array() + 1e-10).all());   // no joint moves farther than it says,
    BOOST_TEST((stop.way() - farthest).cwiseMax(0.0).maxCoeff() < 1e-9);  // nor less
  }
}

BOOST_AUTO_TEST_CASE(a_stop_is_hardly_longer_than_the_shortest) {
  // Along one joint: v/A + A/J is the shortest, where the acceleration reaches its limit.
  JointLimits limits = test::arm_limits(nv);
  limits.velocity.setConstant(10.0);
  limits.acceleration.setConstant(10.0);
  limits.jerk.setConstant(1000.0);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(nv);
  v[2] = 2.0;
  StopTrajectory stop(nv);
  BOOST_REQUIRE(stop.plan(Eigen::VectorXd::Zero(nv), v, Eigen::VectorXd::Zero(nv), limits, T));
  BOOST_TEST(stop.num_periods() >= 210);
  BOOST_TEST(stop.num_periods() <= 252);  // 1.25 v/A, and a whole ramp
}

BOOST_AUTO_TEST_CASE(a_joint_near_its_limit_stops_by_itself) {
  JointLimits limits = test::arm_limits(nv);
  limits.jerk.setConstant(1000.0);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, a = q;
  v[0] = 0.9 * limits.velocity[0];  // takes the longest
  v[3] = 0.05;
  StopTrajectory stop(nv);
  BOOST_REQUIRE(stop.plan(q, v, a, limits, T));
  const double with_all = stop.way()[3];
  q[3] = limits.upper[3] - 0.5 * with_all;
  BOOST_REQUIRE(stop.plan(q, v, a, limits, T));
  BOOST_TEST(stop.way()[3] < 0.5 * with_all);
  q[3] = limits.upper[3] - 1e-6;  // no stop is so short
  BOOST_TEST(!stop.plan(q, v, a, limits, T));
}

BOOST_AUTO_TEST_CASE(planning_a_stop_allocates_nothing) {
  Random random(8);
  JointLimits limits = test::arm_limits(nv);
  limits.jerk.setConstant(500.0);
  StopTrajectory stop(nv);
  const Moving state = random_state(random, limits);
  Eigen::VectorXd a(nv);
  bool planned = false;
  const std::size_t allocations = test::allocations_of([&] {
    planned = stop.plan(state.q, state.v, state.a, limits, T);
    stop.acceleration(3, a);
  });
  BOOST_TEST(planned);
  BOOST_TEST(allocations == 0u);
}
