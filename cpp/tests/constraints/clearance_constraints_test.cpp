#include "sidestep/constraints/clearance_constraints.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::infinity;
using test::Random;

namespace {

ClosingLimits random_limits(Random& random) {
  const double A = random.magnitude(0.01, 100.0);
  return {A, 2.0 * A, random.magnitude(1.0, 50.0), random.uniform(0.1, 1.0)};
}

/// The rows of clearances alone, for one state after the other.
struct Rows : RowBlock {
  Rows(int nv, const SafetySettings& settings)
      : RowBlock((settings.validate(), settings.max_rows), nv, Priority::clearance),
        constraint(JointLimits::unlimited(nv), settings) {}

  void add(const Clearances& clearances, const Eigen::VectorXd& v, const JointLimits& limits, const AccelerationBounds& bounds,
           double period, const BrakingTorque* torque = nullptr, const LastMotion* last = nullptr) noexcept {
    constraint.add(clearances, {v, limits, bounds, period, torque, last}, *this);
  }
  void update(const Clearances& clearances, const Eigen::VectorXd& v, const JointLimits& limits,
              const AccelerationBounds& bounds, double period, const BrakingTorque* torque = nullptr,
              const LastMotion* last = nullptr) noexcept {
    clear();
    add(clearances, v, limits, bounds, period, torque, last);
  }
  bool relax_to_braking(double period) noexcept { return constraint.relax_to_braking(period, *this); }
  bool add_recovery() noexcept { return constraint.add_recovery(*this); }
  bool usable(const Clearances& clearances) const noexcept { return constraint.usable(clearances); }

  ClearanceConstraints constraint;
  const std::vector<int>& coordinates = constraint.coordinates();
  const std::vector<int>& nearest = constraint.nearest();
  const std::vector<char>& along_path = constraint.along_path();
};

/// p(u) of the derivation, written out once more.
double distance_needed(double u, const ClosingLimits& limits) {
  const double A = limits.comfortable, rate = limits.rate;
  return u <= A / rate ? u / rate : u * u / (2.0 * A) + A / (2.0 * rate * rate);
}

/// `num` clearances that are linear in q, h = gradient·q + offset.
Clearances linear_clearances(Random& random, int nv, int num) {
  Clearances clearances(nv, num);
  for (int k = 0; k < num; ++k) {
    clearances.gradients.col(k) = 0.3 * random.vector(nv);
    clearances.values[k] = random.uniform(-0.01, 0.3);
    clearances.rates[k] = random.uniform(-1.0, 1.0);
    clearances.curvatures[k] = random.uniform(-1.0, 1.0);
    clearances.nearest[k] = k;
  }
  clearances.mind_nearest();
  return clearances;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_margin_is_kept_for_ever_and_without_hurry) {
  // A double integrator that is pushed towards the margin as hard as is allowed, under both integration schemes.
  Random random(0);
  for (int trial = 0; trial < 3000; ++trial) {
    const ClosingLimits limits = random_limits(random);
    const double period = random.magnitude(1e-4, 0.02);
    const bool exact = random.chance(0.5);
    double closing = random.uniform(-0.5, 2.0);
    double distance_left = distance_needed(std::max(closing, 0.0), limits) + random.magnitude(1e-6, 0.5);
    for (int k = 0; k < 400; ++k) {
      const double demand = demanded_deceleration(distance_left, closing, limits, period);
      // No more than the deceleration that was planned with. Rounding: closing speeds of 10 over a period of 1e-4.
      const bool comfortable = demand <= limits.comfortable * (1.0 + 1e-9) + 1e-10;
      const double push = random.chance(0.9) ? 10.0 * limits.comfortable : random.uniform(-1.0, 1.0);
      const double deceleration = std::max(demand, -push);
      const double next = closing - deceleration * period;
      distance_left -= exact ? 0.5 * (closing + next) * period : next * period;
      closing = next;
      const bool outside = distance_left >= -1e-12;  // rounding
      const bool stoppable = distance_needed(closing, limits) <= distance_left + 1e-9 * (1.0 + distance_left);
      if (!comfortable || !outside || !stoppable) {  // BOOST_REQUIRE takes longer than the rest of the loop
        BOOST_FAIL("trial " << trial << " step " << k << ": demand " << demand << " of " << limits.comfortable
                            << ", distance left " << distance_left << ", closing at " << closing);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(the_margin_is_reached) {
  // What is kept is the margin, not more: pushed on, the distance left shrinks with the time constant 1/rate.
  const ClosingLimits limits{2.0, 4.0, 20.0, 0.5};
  double distance_left = 0.3, closing = 0.0;
  for (int k = 0; k < 2000; ++k) {
    const double next = closing - std::max(demanded_deceleration(distance_left, closing, limits, 0.001), -5.0) * 0.001;
    distance_left -= 0.001 * next;
    closing = next;
  }
  // 2 s: 0.55 s along the parabola, 1.4 s of time constant 0.05 s.
  BOOST_TEST(distance_left > 0.0);
  BOOST_TEST(distance_left < 1e-10);
}

BOOST_AUTO_TEST_CASE(demands_by_value) {
  const ClosingLimits limits{2.0, 4.0, 10.0, 0.5};  // the line meets the parabola at 0.2 m/s, 0.02 m
  const double T = 0.001;
  // At rest on the margin, nothing may be taken; at rest and 1 mm away, w + ... with w = 0.001/(1/10 + T).
  BOOST_TEST(demanded_deceleration(0.0, 0.0, limits, T) == 0.0);
  BOOST_TEST(demanded_deceleration(0.001, 0.0, limits, T) == -0.001 / 0.101 / T, boost::test_tools::tolerance(1e-12));
  // On the parabola, the deceleration planned with.
  const double u = 0.8;
  BOOST_TEST(demanded_deceleration(distance_needed(u, limits), u, limits, T) == 2.0, boost::test_tools::tolerance(1e-9));
  // On the line under exact integration, w = (s - uT/2)/(1/10 + T/2): a deceleration of 10 (u + w)/2.
  const double w = (0.01 - 0.5 * T * 0.1) / (0.1 + 0.5 * T);
  BOOST_TEST(demanded_deceleration(0.01, 0.1, limits, T) == 10.0 * 0.5 * (0.1 + w), boost::test_tools::tolerance(1e-9));
  // Too fast by 1 mm/s on the parabola: 2 + 0.5 * 0.001/T, and never above the hardest.
  BOOST_TEST(demanded_deceleration(distance_needed(u, limits), u + 0.001, limits, T) == 2.5,
             boost::test_tools::tolerance(1e-9));
  BOOST_TEST(demanded_deceleration(0.01, 1.0, limits, T) == 4.0);
  // Too fast by a half on the line, 10 * 0.15; by more than twice, u^2/2(s - uT).
  BOOST_TEST(demanded_deceleration(0.01, 0.15, limits, T) == 1.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(demanded_deceleration(0.015, 0.31, limits, T) == 0.31 * 0.31 / 2.0 / (0.015 - 0.31 * T),
             boost::test_tools::tolerance(1e-12));
  // Inside by 5 mm and at rest, 2 * 10^2 * 0.005. Closing, the hardest; closing slowly, its end too.
  BOOST_TEST(demanded_deceleration(-0.005, 0.0, limits, T) == 1.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(demanded_deceleration(-0.005, 0.1, limits, T) == 4.0);
  BOOST_TEST(demanded_deceleration(-0.005, 0.002, limits, T) == 1.0 + 0.5 * 0.002 / T, boost::test_tools::tolerance(1e-12));
  // Deeper than the hardest deceleration would take, no more than is planned with; what closes in is slowed harder.
  BOOST_TEST(demanded_deceleration(-0.1, 0.0, limits, T) == 2.0);
  BOOST_TEST(demanded_deceleration(-0.1, -0.001, limits, T) == 2.0);
  BOOST_TEST(demanded_deceleration(-0.1, 0.001, limits, T) == 2.5, boost::test_tools::tolerance(1e-12));
  // Leaving with that speed already: the speed may fall along the line, w = -(0.01 - uT/2)/(1/10 + T/2).
  BOOST_TEST(std::abs(demanded_deceleration(-0.01, -0.1, limits, T) + 1.0) < 0.02);  // -10 u, up to T of order
  // Limits that are infinite leave the line.
  const ClosingLimits unlimited{infinity, infinity, 10.0, 0.5};
  BOOST_TEST(demanded_deceleration(1.0, 0.0, unlimited, T) == -1.0 / 0.101 / T, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(a_stop_along_the_path_meets_all_demands_up_to_twice_the_line) {
  Random random(6);
  int above = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const ClosingLimits limits = random_limits(random);
    const double period = random.magnitude(1e-4, 0.02), closing = random.magnitude(0.001, 2.0);
    const double distance_left = closing * (random.uniform(0.5, 2.0) / limits.rate + period);
    const double demand = demanded_deceleration(distance_left, closing, limits, period);
    BOOST_REQUIRE_LE(demand, limits.rate * closing * (1.0 + 1e-9));
    above += closing > limits.rate * distance_left ? 1 : 0;
  }
  BOOST_TEST(above > 1000);
}

BOOST_AUTO_TEST_CASE(what_is_not_known_of_is_held_off) {
  // Pushed on, while an obstacle comes by `speed` that is not told, or something accelerates the arm unseen.
  const ClosingLimits limits{7.0, 14.0, 20.0, 0.5};
  const double T = 0.001;
  const auto distance_at_the_end = [&](double speed, double acceleration) {
    double distance_left = 0.1, closing = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double demand = std::max(demanded_deceleration(distance_left, closing, limits, T), -5.0);
      closing -= (demand - acceleration) * T;
      distance_left -= (closing + speed) * T;
    }
    return distance_left;
  };
  const auto close = boost::test_tools::tolerance(0.05);
  BOOST_TEST(distance_at_the_end(0.08, 0.0) == -1.5 * 0.08 / 20.0, close);
  BOOST_TEST(distance_at_the_end(0.2, 0.0) == -1.5 * 0.2 / 20.0, close);
  BOOST_TEST(distance_at_the_end(0.0, 3.0) == -3.0 / (2.0 * 20.0 * 20.0), close);
}

BOOST_AUTO_TEST_CASE(a_violation_decays_without_spikes) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const double A = random.magnitude(1.0, 20.0);
    const ClosingLimits limits{A, 2.0 * A, random.uniform(5.0, 50.0), random.uniform(0.1, 1.0)};
    const double period = 0.001, first_distance = random.uniform(-0.2, 0.05), first_closing = random.uniform(-0.2, 1.0);
    double distance_left = first_distance, closing = first_closing, lowest = distance_left;
    for (int k = 0; k < 5000; ++k) {
      const double demand = demanded_deceleration(distance_left, closing, limits, period);
      BOOST_REQUIRE_LE(demand, limits.hardest);
      const double next = closing - demand * period;
      distance_left -= 0.5 * (closing + next) * period;
      closing = next;
      lowest = std::min(lowest, distance_left);
    }
    // Stops within the distance that A needs, plus that of the last part, which decays with at least 0.1 per period.
    const double u = std::max(first_closing, 0.0);
    BOOST_REQUIRE_GE(lowest, std::min(first_distance, 0.0) - u * u / (2.0 * A) - 10.0 * period * u - 1e-12);
    BOOST_REQUIRE_SMALL(distance_left, 1e-3);  // and is back at the margin after 5 s, 25 time constants at least
  }
}

BOOST_AUTO_TEST_CASE(a_row_by_value) {
  JointLimits limits = JointLimits::unlimited(2);
  limits.acceleration << 10.0, 5.0;
  limits.effort << 30.0, 10.0;
  Clearances clearances(2, 3);
  clearances.nearest << -1, 7, -1;
  clearances.values[1] = 0.105;
  clearances.rates[1] = -0.4;
  clearances.gradients.col(1) << 0.3, -0.4;
  clearances.mind_nearest();
  clearances.curvatures[1] = -5.7;
  clearances.approach.curvatures[1] = -0.7;
  Rows rows(2, {});
  const AccelerationBounds anything(2);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(2);
  rows.update(clearances, v, limits, anything, 0.001);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.coordinates[0] == 1);
  BOOST_TEST(rows.nearest[0] == 7);
  BOOST_TEST(rows.lengths[0] == 0.5, boost::test_tools::tolerance(1e-15));
  BOOST_TEST(rows.normals(0, 0) == 0.6, boost::test_tools::tolerance(1e-15));
  BOOST_TEST(rows.normals(0, 1) == -0.8, boost::test_tools::tolerance(1e-15));
  // 0.3 * 10 + 0.4 * 5 = 5 m/s^2 at most, half of it planned with; margin 5 mm, rate 20/s.
  const double demand = demanded_deceleration(0.1, 0.4, {2.5, 5.0, 20.0, 0.5}, 0.001);
  BOOST_TEST(rows.lower[0] == (demand + 0.7) / 0.5, boost::test_tools::tolerance(1e-12));

  // A smaller margin of the clearance's own holds instead, a larger one does not.
  for (const double margin : {0.002, 0.05}) {
    clearances.margins[1] = margin;
    rows.update(clearances, v, limits, anything, 0.001);
    const double distance_left = 0.105 - std::min(margin, 0.005);
    const double expected = demanded_deceleration(distance_left, 0.4, {2.5, 5.0, 20.0, 0.5}, 0.001);
    BOOST_TEST(rows.lower[0] == (expected + 0.7) / 0.5, boost::test_tools::tolerance(1e-12));
  }
  clearances.margins[1] = test::infinity;

  // With torque: M = diag(4, 1), bias (6, -2): 0.3/4 (30 - 6) + 0.4 (10 - 2) = 1.8 + 3.2 = 5 again; with bias (22, -2)
  // 0.6 + 3.2 = 3.8, and within the accelerations as well 0.6 + 0.4 * 5 = 2.6, half of which is planned with.
  const Eigen::MatrixXd mass = Eigen::Vector2d(4.0, 1.0).asDiagonal(), cholesky = Eigen::Vector2d(2.0, 1.0).asDiagonal();
  Eigen::VectorXd bias(2);
  bias << 22.0, -2.0;
  const BrakingTorque torque{mass, cholesky, bias};
  rows.update(clearances, v, limits, anything, 0.001, &torque);
  const double weaker = demanded_deceleration(0.1, 0.4, {1.3, 3.8, 20.0, 0.5}, 0.001);
  BOOST_TEST(rows.lower[0] == (weaker + 0.7) / 0.5, boost::test_tools::tolerance(1e-12));

  // Stopping takes 0.5 s: a line of 2/s instead of 20/s.
  v << 1.0, -2.5;
  rows.update(clearances, v, limits, anything, 0.001);
  const double slower = demanded_deceleration(0.1, 0.4, {2.5, 5.0, 2.0, 0.5}, 0.001);
  BOOST_TEST(rows.lower[0] == (slower + 0.7) / 0.5, boost::test_tools::tolerance(1e-12));
  v.setZero();
  rows.update(clearances, v, limits, anything, 0.001, &torque);

  // Every acceleration within ±b gives at least -(0.6 + 0.8) b.
  const double b = -rows.lower[0] / 1.4;
  const Eigen::VectorXd box = Eigen::VectorXd::Constant(2, std::abs(b));
  BOOST_TEST(rows.lower[0] < 0.0);
  BOOST_TEST(rows.satisfied_within(0, -0.999 * box, 0.999 * box));
  BOOST_TEST(!rows.satisfied_within(0, -1.001 * box, 1.001 * box));
}

BOOST_AUTO_TEST_CASE(reserves_are_what_a_stop_can_do_without) {
  JointLimits limits = JointLimits::unlimited(1);
  limits.acceleration << 10.0;
  limits.jerk << 1000.0;
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(1);
  const LastMotion last{still, 1.0};
  AccelerationBounds bounds(1);
  Rows rows(1, {});
  const auto ask = [&](double distance_left, double closing, double of_arm) {
    const Eigen::VectorXd v = Eigen::VectorXd::Constant(1, -of_arm);
    bounds.update(limits, still, v, 0.001, {}, &still);
    Clearances clearances(1, 1);
    clearances.nearest << 0;
    clearances.values[0] = distance_left + rows.constraint.settings().margin;
    clearances.rates[0] = -closing;
    clearances.gradients.col(0) << 1.0;
    clearances.mind_nearest();
    rows.update(clearances, v, limits, bounds, 0.001, nullptr, &last);
    BOOST_REQUIRE(rows.size == 1);
  };
  // With 5 m/s² and half of the jerk the stop from 0.4 m/s takes 22 mm; the arm's own, with 10 m/s² and all jerk, 10.2 mm.
  ask(0.022, 0.4, 0.4);
  BOOST_TEST(rows.lower[0] == 0.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(rows.relax_to_braking(0.001));
  BOOST_TEST(rows.lower[0] == -0.95, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(!rows.add_recovery());

  ask(0.0107, 0.4, 0.4);
  const double asked = rows.lower[0];
  BOOST_TEST(rows.relax_to_braking(0.001));
  const double least = rows.lower[0];
  BOOST_TEST((least > -0.95 && least < asked));
  const auto way = [](double x) {
    const double next = 0.4 - x * 0.001;
    return std::max(0.4, next) * 0.001 + jerk_braking_distance(next, -x, 10.0, 950.0);
  };
  BOOST_TEST((way(least) <= 0.0107 && way(least - 0.01) > 0.0107));

  // At the margin and without closing, recovery asks for what jerk allows; as a reserve, for nothing.
  ask(-0.03, 0.0, 0.0);
  BOOST_TEST(rows.lower[0] == 0.95, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(rows.relax_to_braking(0.001));
  BOOST_TEST(rows.lower[0] == -0.1, boost::test_tools::tolerance(0.01));  // 0.1 mm/s is none
  BOOST_TEST(rows.add_recovery());
  BOOST_TEST(rows.lower[0] == 0.95, boost::test_tools::tolerance(1e-12));

  // Where the clearance is not lost, the way back is a row of its own, which counts less than what keeps it from closing.
  ask(-0.003, 0.0, 0.0);
  const double back = rows.lower[0];
  BOOST_TEST(rows.relax_to_braking(0.001));
  BOOST_TEST(rows.add_recovery());
  BOOST_REQUIRE(rows.size == 2);
  BOOST_TEST(rows.lower[0] == -0.1, boost::test_tools::tolerance(0.01));
  BOOST_TEST((rows.lower[1] == back && rows.depths[0] == 0.0 && rows.depths[1] > 0.0));
  BOOST_TEST(rows.normals(1, 0) == rows.normals(0, 0));

  // What closes without a distance left has no reserve, nor has what the arm's own stop does not stop.
  ask(-0.003, 0.1, 0.1);
  BOOST_TEST(!rows.relax_to_braking(0.001));
  ask(0.022, 0.4, 0.0);
  BOOST_TEST(!rows.relax_to_braking(0.001));
}

BOOST_AUTO_TEST_CASE(what_accelerations_and_torques_together_give_is_counted_on) {
  // M = (2, 1; 1, 1), so that a₁ = τ₁ − τ₂ and τ₂ = a₁ + a₂. The torques alone allow a₁ = 4.7, the accelerations alone 5. Together
  // they allow 4.5, at a₂ = −5 and τ₂ = −0.5: 0.2 less, half of which counts.
  JointLimits limits = JointLimits::unlimited(2);
  limits.acceleration << 5.0, 5.0;
  limits.effort << 4.2, 0.5;
  const Eigen::MatrixXd mass = Eigen::Matrix2d{{2.0, 1.0}, {1.0, 1.0}}, cholesky = mass.llt().matrixL();
  const Eigen::VectorXd bias = Eigen::Vector2d::Zero();
  const BrakingTorque torque{mass, cholesky, bias};
  Clearances clearances(2, 1);
  clearances.nearest[0] = 0;
  clearances.approach.gradients.col(0) << 1.0, 0.0;
  clearances.approach.values[0] = clearances.values[0] = clearances.least[0] = 0.105;
  clearances.approach.rates[0] = clearances.rates[0] = -1.0;
  clearances.approach.curvatures[0] = clearances.curvatures[0] = 0.0;
  clearances.margins[0] = test::infinity;
  Rows rows(2, {});
  const AccelerationBounds anything(2);
  const Eigen::VectorXd v = Eigen::Vector2d::Zero();  // the obstacle comes
  rows.update(clearances, v, limits, anything, 0.001, &torque);
  const double expected = demanded_deceleration(0.1, 1.0, {2.25, 4.7, 20.0, 0.5}, 0.001);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] == expected, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(the_most_critical_are_kept_in_order) {
  Random random(2);
  const JointLimits limits = test::arm_limits(5);
  SafetySettings settings;
  settings.max_rows = 6;
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(5);
  for (int trial = 0; trial < 200; ++trial) {
    const int num = random.integer(0, 20);
    Clearances clearances = linear_clearances(random, 5, num);
    int within_reach = 0;
    for (int k = 0; k < num; ++k) {
      if (random.chance(0.3)) {
        clearances.nearest[k] = -1;
        clearances.values[k] = infinity;
        clearances.rates[k] = std::numeric_limits<double>::quiet_NaN();  // has no meaning beyond the reach
      } else if (random.chance(0.1)) {
        clearances.gradients.col(k).setZero();  // no joint moves it
      } else {
        ++within_reach;
      }
    }
    clearances.mind_nearest();
    Rows rows(5, settings);
    BOOST_REQUIRE(rows.usable(clearances));
    rows.update(clearances, v, limits, AccelerationBounds(5), 0.001);
    BOOST_REQUIRE_EQUAL(rows.size, std::min(within_reach, 6));
    const auto urgency = [&](int k) { return clearances.values[k] + clearances.rates[k] / settings.rate; };
    for (int row = 1; row < rows.size; ++row) {
      BOOST_REQUIRE_LE(urgency(rows.coordinates[static_cast<std::size_t>(row) - 1]),
                       urgency(rows.coordinates[static_cast<std::size_t>(row)]));
    }
    int more_urgent = 0;
    for (int k = 0; rows.size > 0 && k < num; ++k) {
      const bool counts = clearances.nearest[k] >= 0 && clearances.gradients.col(k).norm() > 0.0;
      more_urgent += counts && urgency(k) <= urgency(rows.coordinates[static_cast<std::size_t>(rows.size) - 1]) ? 1 : 0;
    }
    BOOST_REQUIRE_EQUAL(more_urgent, rows.size);
  }
}

BOOST_AUTO_TEST_CASE(unusable_clearances_are_noticed) {
  Random random(3);
  const Rows rows(4, {});
  const Clearances good = linear_clearances(random, 4, 3);
  BOOST_TEST(rows.usable(good));
  BOOST_TEST(!rows.usable(linear_clearances(random, 3, 3)));
  for (const double bad : {infinity, std::numeric_limits<double>::quiet_NaN()}) {
    Clearances c = good;
    c.approach.values[1] = bad;
    BOOST_TEST(!rows.usable(c));
    c = good, c.approach.rates[1] = bad;
    BOOST_TEST(!rows.usable(c));
    c = good, c.approach.curvatures[1] = bad;
    BOOST_TEST(!rows.usable(c));
    c = good, c.curvatures[1] = bad;
    BOOST_TEST(!rows.usable(c));
    c = good, c.approach.gradients(2, 1) = bad;
    BOOST_TEST(!rows.usable(c));
    c.nearest[1] = -1;
    BOOST_TEST(rows.usable(c));
  }
  Clearances of_nothing = good;
  of_nothing.least[1] = std::numeric_limits<double>::quiet_NaN();
  BOOST_TEST(!rows.usable(of_nothing));
  Clearances short_of_rates = good;
  short_of_rates.approach.rates.resize(2);
  BOOST_TEST(!rows.usable(short_of_rates));
}

BOOST_AUTO_TEST_CASE(settings_of_clearance_constraints_are_checked) {
  const auto message_of = [](auto&& change) {
    SafetySettings settings;
    change(settings);
    try {
      Rows rows(3, settings);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  using S = SafetySettings;
  BOOST_TEST(message_of([](S&) {}).empty());
  BOOST_TEST(message_of([](S& s) { s.margin = -0.01; }).find("margin is -0.01") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.rate = 0.0; }).find("rate is 0") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.braking_fraction = 1.5; }).find("allowed: 0.05 to 1") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.correction = 0.0; }).find("correction") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.max_rows = -1; }).find("max_rows") != std::string::npos);
  // Before anything of that size is allocated, which fails otherwise or takes all memory.
  BOOST_TEST(message_of([](S& s) { s.max_rows = 100'000; }).find("max_rows is 100000") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.max_rows = std::numeric_limits<int>::max(); }).find("allowed: 1 to 256") !=
             std::string::npos);
}

BOOST_AUTO_TEST_CASE(more_than_is_to_be_had_is_asked_for_only_where_room_runs_out) {
  JointLimits limits = JointLimits::unlimited(2);
  limits.acceleration << 10.0, 10.0;
  Clearances clearances(2, 1);
  clearances.nearest << 0;
  clearances.gradients.col(0) << 0.6, -0.8;
  Rows rows(2, {});
  AccelerationBounds bounds(2);
  bounds.lower << -10.0, -5.0;  // close to its lower limit the second joint cannot give all
  bounds.upper << 10.0, 10.0;
  const double now = 0.6 * 10.0 + 0.8 * 5.0;
  const auto lower = [&](double distance_left, double closing, double curvature) {
    clearances.values << distance_left + rows.constraint.settings().margin;
    clearances.rates << -closing;
    clearances.curvatures << curvature;
    clearances.mind_nearest();
    rows.update(clearances, Eigen::VectorXd::Zero(2), limits, bounds, 0.001);
    return rows.lower[0];
  };
  const auto asked = [&](double distance_left, double closing, double curvature) {
    return demanded_deceleration(distance_left, closing, {7.0, 14.0, 20.0, 0.5}, 0.001) - curvature;
  };
  const auto close = boost::test_tools::tolerance(1e-12);
  BOOST_TEST_REQUIRE(asked(0.3, 2.5, -2.0) > now);
  BOOST_TEST(2.5 * 2.5 / (2.0 * (now - 2.0)) > 0.3);
  BOOST_TEST(lower(0.3, 2.5, -2.0) == asked(0.3, 2.5, -2.0), close);  // it does not stop in time
  BOOST_TEST_REQUIRE(asked(0.4, 2.5, -2.0) > now);
  BOOST_TEST(lower(0.4, 2.5, -2.0) == now, close);  // it does
  BOOST_TEST_REQUIRE(asked(-0.02, -0.01, -4.0) > now);
  BOOST_TEST(lower(-0.02, -0.01, -4.0) == now, close);  // too near, but on its way out
  BOOST_TEST_REQUIRE(asked(-0.02, 1e-9, -4.0) > now);
  BOOST_TEST(lower(-0.02, 1e-9, -4.0) == now, close);  // what is asked for does not jump where closing ends
  BOOST_TEST(lower(-0.02, 0.02, -4.0) == 0.5 * 0.02 / 0.001 - -4.0, close);     // the end of closing, not the way back
  BOOST_TEST(lower(-0.02, -0.01, -11.0) == asked(-0.02, -0.01, -11.0), close);  // as long as that lasts
}

BOOST_AUTO_TEST_CASE(rows_ask_for_their_share_of_a_stop_along_the_path) {
  JointLimits limits = JointLimits::unlimited(2);
  limits.acceleration << 10.0, 10.0;
  limits.effort << 30.0, 30.0;
  Clearances clearances(2, 1);
  clearances.nearest << 4;
  clearances.gradients.col(0) << 0.6, 0.8;
  Eigen::VectorXd v(2);
  v << -2.0, 1.0;  // closing in with 0.4 m/s; stops in 0.2 s
  Rows rows(2, {});
  AccelerationBounds bounds(2);
  bounds.lower << -10.0, -10.0;
  bounds.upper << 10.0, 10.0;
  const auto update = [&](double distance_left, double closing, double curvature, const BrakingTorque* torque = nullptr) {
    clearances.values << distance_left + rows.constraint.settings().margin;
    clearances.rates << -closing;
    clearances.curvatures << curvature;
    clearances.mind_nearest();
    rows.update(clearances, v, limits, bounds, 0.001, torque);
  };
  const auto asked = [](double distance_left, double closing, double curvature) {
    return demanded_deceleration(distance_left, closing, {7.0, 14.0, 5.0, 0.5}, 0.001) - curvature;
  };
  const auto close = boost::test_tools::tolerance(1e-12);

  // 0.4 · 0.2/2 + 7 · 0.2²/8 = 0.075 of the 0.08 m: its share of −v/τ is 0.4/0.2.
  update(0.08, 0.4, -7.0);
  BOOST_TEST_REQUIRE(asked(0.08, 0.4, -7.0) > 2.0);
  BOOST_TEST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] == 2.0, close);
  // Less, where less is demanded.
  update(0.081, 0.4, -0.5);
  BOOST_TEST_REQUIRE(asked(0.081, 0.4, -0.5) < 2.0);
  BOOST_TEST(rows.lower[0] == asked(0.081, 0.4, -0.5), close);

  // 0.04 + 0.05 m are too much, but of the 14 m/s² that the bounds give 12 are enough for the next period.
  update(0.08, 0.4, -10.0);
  BOOST_TEST_REQUIRE(asked(0.08, 0.4, -10.0) < 14.0);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] == asked(0.08, 0.4, -10.0), close);

  // Here they are not: the arm has to stop κ times as hard.
  update(0.08, 0.4, -20.0);
  BOOST_TEST_REQUIRE(asked(0.08, 0.4, -20.0) > 14.0);
  BOOST_REQUIRE(rows.size == 2);
  const double hardness = rows.lower[0] / 2.0;
  BOOST_TEST(hardness > 1.0);
  BOOST_TEST(0.04 / hardness + 0.1 / (hardness * hardness) == 0.08, close);
  BOOST_TEST((rows.normals.row(1) + v.transpose() / v.norm()).norm() == 0.0, boost::test_tools::tolerance(1e-15));
  BOOST_TEST(rows.lower[1] == hardness * v.norm() / 0.2, close);
  BOOST_TEST(rows.lengths[1] == 1.0, close);
  BOOST_TEST((rows.along_path[0] == 0 && rows.along_path[1] == 1));
  BOOST_TEST(rows.coordinates[1] == 0);
  BOOST_TEST(rows.nearest[1] == 4);
  // −κ v/τ meets both.
  for (int row : {0, 1}) {
    BOOST_TEST(rows.normals.row(row).dot(-hardness / 0.2 * v.transpose()) == rows.lower[row], close);
  }
  // Where the distance is all but used up the stop is no harder than twice what meets the demand,
  update(1e-9, 0.4, -20.0);
  BOOST_REQUIRE(rows.size == 2);
  BOOST_TEST(rows.lower[0] == asked(1e-9, 0.4, -20.0), close);
  BOOST_TEST(rows.lower[1] == 2.0 * asked(1e-9, 0.4, -20.0) / 2.0 * v.norm() / 0.2, close);
  // not asked for where the gradient does something about the curvature,
  update(1e-9, 0.4, -1.0);
  BOOST_TEST_REQUIRE(asked(1e-9, 0.4, -1.0) > 14.0);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] == asked(1e-9, 0.4, -1.0), close);
  // and where no stop meets the demand, at a crest, takes half of the velocity in a period.
  clearances.gradients.col(0) << 0.4, 0.8;
  update(1e-9, 0.0, -20.0);
  BOOST_REQUIRE(rows.size == 2);
  BOOST_TEST(rows.lower[0] * rows.lengths[0] == 0.0, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(rows.lower[1] == 0.5 * v.norm() / 0.001, close);
  clearances.gradients.col(0) << 0.6, 0.8;

  // Where the gradient alone would stop it in time, limits are kept.
  update(0.08, 0.4, -12.5);
  BOOST_TEST_REQUIRE(asked(0.08, 0.4, -12.5) > 14.0);
  BOOST_TEST_REQUIRE(0.4 * 0.4 / (2.0 * (14.0 - 12.5)) < 0.08);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] <= 14.0);

  // If all rows are in use, the least critical one gives way.
  SafetySettings single;
  single.max_rows = 1;
  Rows one(2, single);
  clearances.values << 0.085;
  clearances.curvatures << -20.0;
  clearances.mind_nearest();
  one.update(clearances, v, limits, bounds, 0.001);
  BOOST_REQUIRE(one.size == 1);
  BOOST_TEST((one.along_path[0] == 1));

  // What comes by itself does not stop with the arm.
  update(0.08, 0.5, -20.0);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST((rows.along_path[0] == 0));
  BOOST_TEST(rows.lower[0] == asked(0.08, 0.5, -20.0), close);

  // M = diag(4, 1): joint 1 needs 8 Nm s over the 44 Nm that a bias of −14 Nm leaves to stop in, or over 16 Nm.
  const Eigen::MatrixXd mass = Eigen::Vector2d(4.0, 1.0).asDiagonal(), cholesky = Eigen::Vector2d(2.0, 1.0).asDiagonal();
  Eigen::VectorXd bias(2);
  bias << -14.0, 0.0;
  const BrakingTorque torque{mass, cholesky, bias};
  update(0.08, 0.4, -7.0, &torque);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] == 0.4 / 0.2, close);
  bias[0] = 14.0;
  update(0.2, 0.4, -2.0, &torque);
  BOOST_REQUIRE(rows.size == 1);
  BOOST_TEST(rows.lower[0] == 0.4 / 0.5, close);
}

BOOST_AUTO_TEST_CASE(past_the_crest_of_a_clearance_an_arm_stops_along_its_path) {
  // h = 0.055 − q²: with 2 rad/s past the crest, where no acceleration along ∇h does anything, and driven on.
  JointLimits limits = JointLimits::unlimited(1);
  limits.acceleration << 10.0;
  Clearances clearances(1, 1);
  clearances.nearest << 0;
  Rows rows(1, {});
  AccelerationBounds bounds(1);
  bounds.lower << -10.0;
  bounds.upper << 10.0;
  double q = -0.3, hardest = 0.0, least = 1.0;
  Eigen::VectorXd v(1);
  v << 2.0;
  for (int step = 0; step < 1000; ++step) {
    clearances.values << 0.055 - q * q;
    clearances.rates << -2.0 * q * v[0];
    clearances.curvatures << -2.0 * v[0] * v[0];
    clearances.gradients << -2.0 * q;
    clearances.mind_nearest();
    rows.update(clearances, v, limits, bounds, 0.001);
    double a = v[0] < 2.0 ? 10.0 : 0.0;
    for (int row = 0; row < rows.size; ++row) {
      if (rows.normals(row, 0) < 0.0) {
        a = std::min(a, -rows.lower[row]);
      }
    }
    hardest = std::max(hardest, -a);
    q += 0.001 * v[0] + 0.5e-6 * a;
    v[0] += 0.001 * a;
    least = std::min(least, q > 0.0 ? 0.05 - q * q : 1.0);
  }
  BOOST_TEST(hardest < 15.0);  // against the curvature alone it would take 8/|∇h|, 70 and more
  // of the margin's 5 mm: what is demanded at last is what a stop takes now, without its bend
  BOOST_TEST(least > -5e-4);
  BOOST_TEST(least < 0.005);  // it comes close
  BOOST_TEST(std::abs(v[0]) < 0.01);
}

BOOST_AUTO_TEST_CASE(update_allocates_nothing) {
  Random random(4);
  const JointLimits limits = test::arm_limits(7);
  Rows rows(7, {});
  const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(7, 7), cholesky = mass;
  const Eigen::VectorXd bias = Eigen::VectorXd::Zero(7), v = bias;
  const BrakingTorque torque{mass, cholesky, bias};
  const AccelerationBounds bounds(7);
  for (int num : {0, 1, 16, 32, 80}) {
    const Clearances clearances = linear_clearances(random, 7, num);
    BOOST_REQUIRE_EQUAL(test::allocations_of([&] {
                          if (rows.usable(clearances)) {
                            rows.update(clearances, v, limits, bounds, 0.001, &torque);
                          }
                        }),
                        0u);
  }
}

BOOST_AUTO_TEST_CASE(changing_points_never_make_a_surface_recede) {
  JointLimits limits = JointLimits::unlimited(1);
  limits.acceleration << 10.0;
  limits.effort << 30.0;
  Clearances clearances(1, 1);
  clearances.nearest << 0;
  clearances.values << 0.105;
  clearances.rates << -0.4;
  clearances.gradients << 1.0;
  clearances.mind_nearest();
  Rows rows(1, {});
  const double demand = demanded_deceleration(0.1, 0.4, {5.0, 10.0, 20.0, 0.5}, 0.001);
  const auto lower = [&](double of_nearest, double of_points) {
    clearances.curvatures << of_nearest;
    clearances.approach.curvatures << of_points;
    rows.update(clearances, Eigen::VectorXd::Zero(1), limits, AccelerationBounds(1), 0.001);
    return rows.lower[0] - demand;
  };
  const auto close = boost::test_tools::tolerance(1e-9);
  BOOST_TEST(lower(-430.0, 2.0) == 0.0, close);   // going over to another point, while each recedes
  BOOST_TEST(lower(-430.0, -3.0) == 3.0, close);  // while each comes
  BOOST_TEST(lower(0.0, 14.0) == 0.0, close);     // sliding along a flat wall of points
  BOOST_TEST(lower(-3.0, 11.0) == 0.0, close);    // along a hollow one
  BOOST_TEST(lower(9.0, 9.0) == -9.0, close);     // past one point
}

BOOST_AUTO_TEST_CASE(rows_of_a_second_state_are_added_to_those_of_the_first) {
  Random random(5);
  const JointLimits limits = test::arm_limits(4);
  AccelerationBounds bounds(4);
  bounds.lower.setConstant(-10.0);
  bounds.upper.setConstant(10.0);
  int most = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Clearances first = linear_clearances(random, 4, 5), second = linear_clearances(random, 4, 5);
    const Eigen::VectorXd v = random.vector(4), other = random.vector(4);
    Rows both(4, {}), one(4, {}), two(4, {});
    one.update(first, v, limits, bounds, 0.001);
    two.update(second, other, limits, bounds, 0.001);
    both.update(first, v, limits, bounds, 0.001);
    both.add(second, other, limits, bounds, 0.001);
    BOOST_REQUIRE(both.size == one.size + two.size);
    const auto has = [&](const Rows& part, int row) {
      for (int k = 0; k < both.size; ++k) {
        if ((both.normals.row(k) == part.normals.row(row)) && both.lower[k] == part.lower[row] &&
            both.coordinates[static_cast<std::size_t>(k)] == part.coordinates[static_cast<std::size_t>(row)]) {
          return true;
        }
      }
      return false;
    };
    for (int k = 0; k < one.size; ++k) {
      BOOST_REQUIRE(has(one, k));
    }
    for (int k = 0; k < two.size; ++k) {
      BOOST_REQUIRE(has(two, k));
    }
    most = std::max(most, both.size);
  }
  BOOST_TEST(most > 5);
}
