#include "sidestep/constraints/acceleration_bounds.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"

using namespace sidestep;
using test::infinity;
using test::Random;
using boost::test_tools::tolerance;

namespace {

// Rounding of q and v, of size up to 10, added up while braking for up to 1e4 periods.
constexpr double rounding = 1e-11;

enum class Integrator { exact, semi_implicit };

void step(double& q, double& v, double a, double period, Integrator integrator) {
  q += v * period + (integrator == Integrator::exact ? 0.5 : 1.0) * a * period * period;
  v += a * period;
}

/// Limits and periods of all sizes: ranges from below one braking step to a full turn, some infinite.
ScalarLimits random_limits(Random& random, double& period) {
  period = random.magnitude(1e-4, 1e-2);
  ScalarLimits limits{};
  limits.acceleration = random.chance(0.05) ? infinity : random.magnitude(0.1, 1e3);
  limits.velocity = random.chance(0.05) ? infinity : random.magnitude(1e-2, 10.0);
  const double unit = std::isfinite(limits.acceleration) ? limits.acceleration * period * period : 1e-4;
  limits.lower = random.uniform(-3.0, 3.0);
  limits.upper = limits.lower + (random.chance(0.2) ? random.magnitude(0.1, 100.0) * unit : random.magnitude(1e-3, 6.0));
  if (random.chance(0.05)) {
    limits.lower = -infinity;
  }
  if (random.chance(0.05)) {
    limits.upper = infinity;
  }
  return limits;
}

/// A viable state, as likely on the border of the viable set as inside it.
void random_viable_state(Random& random, const ScalarLimits& limits, double period, double& q, double& v) {
  const double low = std::isfinite(limits.lower) ? limits.lower : std::min(limits.upper, 3.0) - 6.0;
  const double high = std::isfinite(limits.upper) ? limits.upper : std::max(limits.lower, -3.0) + 6.0;
  const double fastest = std::min(limits.velocity, 10.0);
  q = random.uniform(low, high);
  v = random.uniform(-fastest, fastest);
  if (!is_viable(q, v, limits, period)) {  // slow down to the border
    double slow = 0.0, fast = v;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (slow + fast);
      (is_viable(q, middle, limits, period) ? slow : fast) = middle;
    }
    v = slow;
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(braking_distance_is_that_of_braking) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const double A = random.magnitude(0.1, 100.0), period = random.magnitude(1e-3, 1e-1);
    const double speed = random.uniform(0.0, 500.0) * A * period;
    double v = speed, q = 0.0;
    while (v > A * period) {
      step(q, v, -A, period, Integrator::exact);
    }
    q += 0.5 * v * period;  // last period: just to rest
    // Rounding of up to 500 additions.
    BOOST_REQUIRE_SMALL(braking_distance(speed, A, period) - q, 1e-12 * (q + A * period * period));
    BOOST_REQUIRE_GE(q, 0.5 * speed * speed / A * (1.0 - 1e-12));  // no shorter than continuous braking
  }
  BOOST_TEST(braking_distance(-1.0, 10.0, 0.001) == 0.0);
  BOOST_TEST(braking_distance(2.0, infinity, 0.001) == 0.001);  // to rest within one period
}

BOOST_AUTO_TEST_CASE(the_viable_velocity_is_the_fastest_from_which_the_limits_can_be_kept) {
  Random random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    double period = 0.0, q = 0.0, v = 0.0;
    const ScalarLimits limits = random_limits(random, period);
    random_viable_state(random, limits, period, q, v);
    BOOST_REQUIRE(std::abs(viable_velocity(q, v, limits, period) - v) < rounding);
    const double up = viable_velocity(q, 1e3, limits, period), down = viable_velocity(q, -1e3, limits, period);
    const double more = 1e-6 * (1.0 + up), less = -1e-6 * (1.0 - down);
    BOOST_REQUIRE(up >= 0.0);
    BOOST_REQUIRE(down <= 0.0);
    BOOST_REQUIRE(is_viable(q, up, limits, period, rounding));
    BOOST_REQUIRE(is_viable(q, down, limits, period, rounding));
    BOOST_REQUIRE((up == 1e3 || !is_viable(q, up + more, limits, period)));
    BOOST_REQUIRE((down == -1e3 || !is_viable(q, down + less, limits, period)));
  }
  const ScalarLimits limits{-1.0, 1.0, 2.0, 10.0};
  BOOST_TEST(viable_velocity(0.0, 5.0, limits, 0.001) == 2.0);                     // the velocity limit
  BOOST_TEST(viable_velocity(0.95, 5.0, limits, 0.001) == 1.0, tolerance(1e-12));  // v²/2A = 50 mm, in whole periods
  BOOST_TEST(viable_velocity(1.2, 0.5, limits, 0.001) == 0.0);                     // beyond the limit, not farther out
  BOOST_TEST(viable_velocity(1.2, -0.5, limits, 0.001) == -0.5);
}

BOOST_AUTO_TEST_CASE(any_choice_from_a_viable_state_stays_inside_for_ever) {
  // 3e4 trajectories of 100 steps, 3 million in all: at one end of the interval, jumping between both, or anywhere.
  Random random(2);
  for (int trial = 0; trial < 30000; ++trial) {
    double period = 0.0, q = 0.0, v = 0.0;
    const ScalarLimits limits = random_limits(random, period);
    random_viable_state(random, limits, period, q, v);
    const Integrator integrator = random.chance(0.5) ? Integrator::exact : Integrator::semi_implicit;
    const int habit = random.integer(0, 3);
    for (int k = 0; k < 100; ++k) {
      const AccelerationInterval bounds = acceleration_interval(q, v, limits, period);
      const bool ordered =
          bounds.lower <= bounds.upper && -limits.acceleration <= bounds.lower && bounds.upper <= limits.acceleration;
      if (!ordered) {  // BOOST_REQUIRE takes longer than the rest of the loop
        BOOST_FAIL("trial " << trial << " step " << k << ": [" << bounds.lower << ", " << bounds.upper << "]");
      }
      const bool high = habit == 0 || (habit >= 2 && random.chance(0.5));
      double a = high ? bounds.upper : bounds.lower;
      if (habit == 3 && std::isfinite(bounds.upper - bounds.lower)) {
        a = random.uniform(bounds.lower, bounds.upper);
      }
      if (!std::isfinite(a)) {
        a = std::clamp(std::copysign(1e3, a), bounds.lower, bounds.upper);
      }
      const double before = q, speed = v;
      step(q, v, a, period, integrator);
      if (!is_viable(q, v, limits, period, rounding * (1.0 + std::abs(v)))) {
        BOOST_FAIL("trial " << trial << " step " << k << ": q = " << q << ", v = " << v << " after " << before << ", " << speed
                            << " with a = " << a << " of [" << bounds.lower << ", " << bounds.upper << "]; limits "
                            << limits.lower << ", " << limits.upper << ", " << limits.velocity << ", " << limits.acceleration
                            << ", period " << period);
      }
      if (integrator == Integrator::exact && speed * v < 0.0) {  // the turn between the samples
        const double peak = before - 0.5 * speed * speed / a;
        if (peak > limits.upper + rounding || peak < limits.lower - rounding) {
          BOOST_FAIL("trial " << trial << " step " << k << ": turns at " << peak);
        }
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(the_bounds_are_not_tighter_than_needed) {
  // Slow oracle: a little beyond the end, the next state is not viable in one of the two integrations.
  Random random(3);
  int checked = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    double period = 0.0, q = 0.0, v = 0.0;
    const ScalarLimits limits = random_limits(random, period);
    random_viable_state(random, limits, period, q, v);
    const AccelerationInterval bounds = acceleration_interval(q, v, limits, period);
    if (!(bounds.upper < limits.acceleration)) {
      continue;
    }
    ++checked;
    const double beyond = bounds.upper + 1e-11 / (period * period);  // moves q by 1e-11, 1e4 roundings of it
    bool viable = true;
    for (const Integrator integrator : {Integrator::exact, Integrator::semi_implicit}) {
      double next_q = q, next_v = v;
      step(next_q, next_v, beyond, period, integrator);
      viable = viable && is_viable(next_q, next_v, limits, period);
    }
    BOOST_REQUIRE_MESSAGE(!viable, "trial " << trial << ": upper bound " << bounds.upper << " is too low");
  }
  BOOST_TEST(checked > 10000);
}

BOOST_AUTO_TEST_CASE(not_viable_inside_means_full_braking) {
  const ScalarLimits limits{-1.0, 1.0, 2.0, 10.0};
  const AccelerationInterval bounds = acceleration_interval(0.99, 1.0, limits, 0.001);  // needs 0.05, has 0.01
  BOOST_TEST(bounds.lower == -10.0);
  BOOST_TEST(bounds.upper == -10.0);
  BOOST_TEST((bounds.upper_limit == Limit::position_upper));
}

BOOST_AUTO_TEST_CASE(from_outside_any_choice_comes_back_and_stays) {
  Random random(4);
  int checked = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const double period = random.magnitude(1e-3, 1e-2), A = random.magnitude(0.5, 100.0);
    const double V = random.magnitude(2.0 * A * period, 5.0);
    const double lower = random.uniform(-3.0, 2.0);
    const ScalarLimits limits{lower, lower + random.magnitude(A * period * period, 3.0), V, A};
    const bool above = random.chance(0.5);
    const double excess = random.magnitude(1e-6, 0.3);
    double q = above ? limits.upper + excess : limits.lower - excess;
    double v = random.uniform(-1.5, 1.5) * V;
    const Integrator integrator = random.chance(0.5) ? Integrator::exact : Integrator::semi_implicit;
    // The slowest choice: brake from 1.5 V, turn, come back by a parabola or at V. Then the same once more, because a
    // joint that starts too fast towards the inside of a narrow range comes out at the other end.
    const double farthest = excess + 1.5 * V * (1.5 * V / (2.0 * A) + period);
    const double time = 2.0 * (1.5 * V / A + 2.0 * std::sqrt(2.0 * farthest / A) + farthest / V) + 20.0 * period;
    const int steps = static_cast<int>(std::ceil(time / period));
    const int habit = random.integer(0, 2);
    bool inside = false;
    for (int k = 0; k < steps; ++k) {
      const AccelerationInterval bounds = acceleration_interval(q, v, limits, period);
      const bool ordered = bounds.lower <= bounds.upper && -A <= bounds.lower && bounds.upper <= A;
      const double slowest = above ? bounds.upper : bounds.lower, fastest = above ? bounds.lower : bounds.upper;
      const double a = habit == 0 ? slowest : habit == 1 ? fastest : random.uniform(bounds.lower, bounds.upper);
      step(q, v, a, period, integrator);
      const bool viable = is_viable(q, v, limits, period, rounding);
      if (!ordered || (inside && !viable)) {
        BOOST_FAIL("trial " << trial << " step " << k << (ordered ? " left again" : " has an empty interval") << ": q = " << q
                            << ", v = " << v << " after [" << bounds.lower << ", " << bounds.upper << "]");
      }
      inside = viable;
    }
    ++checked;
    BOOST_REQUIRE_MESSAGE(inside, "trial " << trial << " is not back: q = " << q << " of [" << limits.lower << ", "
                                           << limits.upper << "], v = " << v << " of " << V);
  }
  BOOST_TEST(checked == 3000);
}

BOOST_AUTO_TEST_CASE(too_fast_is_slowed_down_with_full_acceleration) {
  const ScalarLimits limits{-infinity, infinity, 2.0, 10.0};
  const AccelerationInterval bounds = acceleration_interval(0.0, 2.5, limits, 0.001);
  BOOST_TEST(bounds.upper == -10.0);
  BOOST_TEST(bounds.lower == -10.0);
  BOOST_TEST((bounds.upper_limit == Limit::velocity_upper));
}

BOOST_AUTO_TEST_CASE(no_limits_no_bounds) {
  const ScalarLimits limits{-infinity, infinity, infinity, infinity};
  const AccelerationInterval bounds = acceleration_interval(1.0, -3.0, limits, 0.001);
  BOOST_TEST(bounds.lower == -infinity);
  BOOST_TEST(bounds.upper == infinity);
}

BOOST_AUTO_TEST_CASE(bounds_name_their_limit) {
  const ScalarLimits limits{-1.0, 1.0, 2.0, 10.0};
  const AccelerationInterval rest = acceleration_interval(0.0, 0.0, limits, 0.001);
  BOOST_TEST((rest.upper_limit == Limit::acceleration_upper && rest.lower_limit == Limit::acceleration_lower));
  const AccelerationInterval fast = acceleration_interval(0.0, 1.995, limits, 0.001);
  BOOST_TEST((fast.upper_limit == Limit::velocity_upper));
  BOOST_TEST(fast.upper == 5.0, tolerance(1e-12));  // (2 - 1.995) / 0.001; the difference loses three digits
  const AccelerationInterval mirrored = acceleration_interval(0.0, -1.995, limits, 0.001);
  BOOST_TEST((mirrored.lower_limit == Limit::velocity_lower));
  BOOST_TEST(mirrored.lower == -fast.upper);
  const AccelerationInterval near = acceleration_interval(1.0 - 2e-6, 0.0, limits, 0.001);
  BOOST_TEST((near.upper_limit == Limit::position_upper));
  // At rest 2e-6 before the limit: w T + w T/2 = 2e-6 gives w = 4/3 mm/s. 1 - 2e-6 loses six digits.
  BOOST_TEST(near.upper == 4.0 / 3.0, tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(update_applies_the_margin_and_allocates_nothing) {
  JointLimits limits = JointLimits::unlimited(2);
  limits.lower << -1.0, -infinity;
  limits.upper << 1.0, infinity;
  limits.velocity.setConstant(2.0);
  limits.acceleration.setConstant(10.0);
  AccelerationBounds bounds(2);
  const Eigen::VectorXd q = Eigen::Vector2d(0.95, 0.0), v = Eigen::Vector2d::Zero();
  BOOST_TEST(test::allocations_of([&] { bounds.update(limits, q, v, 0.001, {0.1}); }) == 0u);
  BOOST_TEST(bounds.upper[0] == -10.0);  // outside by the margin: steer back
  BOOST_TEST(bounds.upper[1] == 10.0);
  bounds.update(limits, q, v, 0.001);
  BOOST_TEST(bounds.upper[0] == 10.0);
}

BOOST_AUTO_TEST_SUITE(smooth_bounds)

BOOST_AUTO_TEST_CASE(the_way_back_into_a_position_limit_waits_for_the_jerk) {
  // As measured by an encoder that rounds: back at once would take 2 · 3e-6 m / T² = 6 m/s².
  JointLimits limits = JointLimits::unlimited(2);
  limits.lower << -1.0, -1.0;
  limits.upper << 1.0, 1.0;
  limits.velocity.setConstant(2.0);
  limits.acceleration.setConstant(10.0);
  limits.jerk.setConstant(1000.0);
  Eigen::VectorXd q = Eigen::Vector2d(-1.0 - 3e-6, 1.0 + 3e-6), v = Eigen::Vector2d::Zero(), a = Eigen::Vector2d::Zero();
  AccelerationBounds bounds(2);
  for (int k = 0; k < 100; ++k) {
    bounds.update(limits, q, v, 0.001, {}, &a);
    if (k == 0) {
      BOOST_TEST(bounds.lower[0] == 1.0, tolerance(1e-9));
      BOOST_TEST(bounds.upper[1] == -1.0, tolerance(1e-9));
    }
    const Eigen::Vector2d next(bounds.smooth_lower[0], bounds.smooth_upper[1]);  // farthest out
    BOOST_REQUIRE(((next - a).cwiseAbs().array() <= 1.0 + 1e-9).all());
    a = next;
    q += 0.001 * v + 0.5e-6 * a;
    v += 0.001 * a;
    BOOST_REQUIRE((q[0] >= -1.0 - 3.1e-6 && q[1] <= 1.0 + 3.1e-6));
  }
  BOOST_TEST((q[0] >= -1.0 - 1e-9 && q[1] <= 1.0 + 1e-9));
}

// The way of the smooth profile, against its own integration in small steps.
BOOST_AUTO_TEST_CASE(the_way_to_rest_is_that_of_the_profile) {
  Random random(71);
  for (int k = 0; k < 400; ++k) {
    const double A = random.magnitude(0.5, 20.0), J = A * random.magnitude(2.0, 1e3);
    const double a = random.uniform(-A, A), v = random.uniform(0.0, 3.0);
    const double found = jerk_braking_distance(v, a, A, J);
    // The acceleration falls to -A, or to where the way back to zero takes the rest of the speed.
    const double h = 2e-6 * std::sqrt(1.0 + 1e3 / J);
    double x = 0.0, speed = v, b = a, farthest = 0.0;
    while (speed > 0.0) {
      const double lost = b < 0.0 ? 0.5 * b * b / J : 0.0;  // while the acceleration goes back to zero
      b = speed <= lost ? std::min(b + J * h, 0.0) : std::max(b - J * h, -A);
      if (b == 0.0 && speed < 1e-4) {
        break;
      }
      x += h * speed + 0.5 * b * h * h;
      speed += b * h;
      farthest = std::max(farthest, x);
    }
    BOOST_TEST_CONTEXT("A " << A << " J " << J << " a " << a << " v " << v) {
      BOOST_TEST(std::abs(found - farthest) < 1e-3 * (0.01 + farthest));
    }
  }
}

// Whoever takes any acceleration of the interval, for ever, keeps every limit: position, velocity, acceleration, jerk.
BOOST_AUTO_TEST_CASE(every_limit_is_kept_for_ever) {
  Random random(72);
  for (int k = 0; k < 3000; ++k) {
    const double period = random.magnitude(5e-4, 1e-2);
    ScalarLimits limits{};
    limits.acceleration = random.magnitude(0.5, 50.0);
    limits.velocity = random.magnitude(0.05, 5.0);
    limits.lower = random.uniform(-3.0, 3.0);
    limits.upper = limits.lower + random.magnitude(0.05, 6.0);
    const double jerk = limits.acceleration / period * random.magnitude(0.01, 3.0);
    double q = random.uniform(limits.lower, limits.upper), v = 0.0, a = 0.0;
    const Integrator integrator = random.chance(0.5) ? Integrator::exact : Integrator::semi_implicit;
    const int kind = static_cast<int>(random.uniform(0.0, 4.0));
    double worst_jerk = 0.0, worst_a = 0.0, worst_v = 0.0, worst_q = 0.0;
    double way = 1.0;
    for (int n = 0; n < 600; ++n) {
      const AccelerationInterval interval = acceleration_interval(q, v, limits, period);
      const SmoothInterval smooth = smooth_interval(q, v, a, interval, limits, jerk, period);
      BOOST_REQUIRE(smooth.lower <= smooth.upper);
      if (random.chance(0.01)) {
        way = -way;
      }
      const double share = kind == 0   ? (way > 0.0 ? 1.0 : 0.0)
                           : kind == 1 ? random.uniform(0.0, 1.0)
                           : kind == 2 ? 1.0
                                       : (n / 40) % 2;
      const double x = smooth.lower + share * (smooth.upper - smooth.lower);
      worst_jerk = std::max(worst_jerk, std::abs(x - a) / (jerk * period) - 1.0);
      step(q, v, x, period, integrator);
      a = x;
      worst_a = std::max(worst_a, std::abs(x) / limits.acceleration - 1.0);
      worst_v = std::max(worst_v, std::abs(v) / limits.velocity - 1.0);
      worst_q = std::max({worst_q, q - limits.upper, limits.lower - q});
    }
    BOOST_TEST_CONTEXT("case " << k << " period " << period << " A " << limits.acceleration << " V " << limits.velocity
                               << " range " << limits.upper - limits.lower << " ramp [periods] "
                               << limits.acceleration / jerk / period) {
      BOOST_TEST(worst_jerk < 1e-6);
      BOOST_TEST(worst_a < 1e-12);
      BOOST_TEST(worst_v < 1e-9);
      BOOST_TEST(worst_q < 1e-9);
    }
  }
}

BOOST_AUTO_TEST_SUITE_END()
